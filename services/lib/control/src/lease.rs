//! Who holds the sticks, and how far he has the drone in hand (DESIGN 4, "Lease" and "Liveness").
//!
//! One holder at a time. A lease has a number that never comes back, so that sticks sent under an old one are told
//! apart. Only a *new* input of the human keeps it: one that is repeated grows old, whatever layer repeats it.

/// How far a human has the drone in hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Hand {
    /// Nobody holds the sticks.
    #[default]
    Free = 0,
    /// Granted; the drone comes to a stop first.
    Stopping = 1,
    /// It stands; the sticks must pass neutral.
    AwaitingNeutral = 2,
    /// It follows while the button is held.
    Ready = 3,
    /// It follows.
    Following = 4,
    /// Nothing new is heard of the holder: it hovers.
    Silent = 5,
}

/// The four sticks, each -1..=1: forward, left, up, counter-clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Axes {
    /// Forward.
    pub forward: f32,
    /// Left.
    pub left: f32,
    /// Up.
    pub up: f32,
    /// Counter-clockwise.
    pub turn: f32,
}

impl Axes {
    /// `None` when one is no number or beyond its range.
    #[must_use]
    pub fn checked(forward: f32, left: f32, up: f32, turn: f32) -> Option<Self> {
        let fits = [forward, left, up, turn].iter().all(|axis| (-1.0..=1.0).contains(axis));
        fits.then_some(Self { forward, left, up, turn })
    }

    /// Whether all four are within `band` of their middle.
    #[must_use]
    pub fn neutral(&self, band: f32) -> bool {
        [self.forward, self.left, self.up, self.turn].iter().all(|axis| axis.abs() <= band)
    }

    /// By how much the one that differs most does.
    #[must_use]
    pub fn apart(&self, other: &Self) -> f32 {
        [self.forward - other.forward, self.left - other.left, self.up - other.up, self.turn - other.turn]
            .into_iter()
            .fold(0.0, |most, difference| most.max(difference.abs()))
    }

    /// What they ask for: nothing within `band`, and from there evenly on to the full deflection.
    #[must_use]
    pub fn beyond(&self, band: f32) -> Self {
        let scaled = |axis: f32| {
            let more = (axis.abs() - band).max(0.0) / (1.0 - band).max(0.1);
            more.min(1.0).copysign(axis)
        };
        Self {
            forward: scaled(self.forward),
            left: scaled(self.left),
            up: scaled(self.up),
            turn: scaled(self.turn),
        }
    }
}

/// One input of a human's hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickInput {
    /// Number of the lease that it is sent under.
    pub lease: u64,
    /// Counts the inputs of the human.
    pub sequence: u64,
    /// When the hand made it, nanoseconds of the drone's clock.
    pub made_ns: u64,
    /// The sticks.
    pub axes: Axes,
    /// Whether the take-over button is held.
    pub held: bool,
    /// A centred climb stick holds the height.
    pub height_hold: bool,
    /// A centred turn stick holds the heading.
    pub heading_hold: bool,
    /// Whether the arm switch is on; `None`: the device has none.
    pub arm: Option<bool>,
}

/// What became of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// It is the newest of the holder.
    Taken,
    /// The holder's, and not newer than what is known.
    Repeated,
    /// Of no lease that holds, or made before it was granted.
    Foreign,
}

/// Under which terms a lease lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// An input this old is flown no more, seconds.
    pub hover_s: f32,
    /// And the lease is over, seconds.
    pub lease_s: f32,
    /// So much earlier than `hover_s` nothing is made of it any more: what is made must still reach the motors, seconds.
    pub spare_s: f32,
    /// A stick so near to its middle is neutral.
    pub neutral: f32,
}

/// Who moves the drone, as far as the lease must know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Under {
    /// It is on the ground.
    Ground,
    /// In the air, and the holder's: whether it stands.
    Hand {
        /// Whether it stands.
        stands: bool,
    },
    /// In the air and nobody's for now: it takes off or lands.
    Other,
}

/// The arm switch was moved under this lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// From off to on.
    On,
    /// From on to off.
    Off,
}

#[derive(Clone, Copy, Debug)]
struct Grip<W> {
    number: u64,
    who: W,
    granted_ns: u64,
    hand: Hand,
    newest: Option<StickInput>,
    arm: Option<bool>,
    flip: Option<Flip>,
}

impl<W> Grip<W> {
    /// Age of the newest input, or of the grant before any, seconds.
    fn age_s(&self, now: u64) -> f32 {
        let made_ns = self.newest.map_or(self.granted_ns, |input| input.made_ns);
        (now.saturating_sub(made_ns) as f64 * 1e-9) as f32
    }
}

/// The lease of the sticks. `W` is what tells one holder from another.
#[derive(Clone, Copy, Debug)]
pub struct Lease<W> {
    last: u64,
    grip: Option<Grip<W>>,
}

impl<W> Default for Lease<W> {
    fn default() -> Self {
        Self { last: 0, grip: None }
    }
}

impl<W: Copy + PartialEq> Lease<W> {
    /// Nobody's, after a restart of who keeps it: no number up to this one comes again.
    #[must_use]
    pub fn after(number: u64) -> Self {
        Self { last: number, grip: None }
    }

    /// Asks for the sticks. Who holds them already keeps his lease.
    ///
    /// Numbers are microseconds of the clock, or one more than the last: even when the last is forgotten they do not come
    /// back, and a program that keeps numbers as doubles can keep them for centuries.
    ///
    /// # Errors
    /// Who holds them.
    pub fn ask(&mut self, now: u64, who: W, terms: &Terms) -> Result<u64, W> {
        match &self.grip {
            Some(grip) if grip.age_s(now) < terms.lease_s => {
                if grip.who == who {
                    Ok(grip.number)
                } else {
                    Err(grip.who)
                }
            }
            _ => {
                self.last = self.last.saturating_add(1).max(now / 1000);
                self.grip = Some(Grip {
                    number: self.last,
                    who,
                    granted_ns: now,
                    hand: Hand::Stopping,
                    newest: None,
                    arm: None,
                    flip: None,
                });
                Ok(self.last)
            }
        }
    }

    /// The holder lets go; false when it is somebody else.
    pub fn release(&mut self, who: &W) -> bool {
        let his = self.holder() == Some(who);
        if his {
            self.grip = None;
        }
        his
    }

    /// Takes the sticks away from whoever holds them; false when nobody does.
    pub fn revoke(&mut self) -> bool {
        self.grip.take().is_some()
    }

    /// Takes an input.
    pub fn hear(&mut self, now: u64, input: &StickInput, terms: &Terms) -> Heard {
        let Some(grip) = self.grip.as_mut().filter(|grip| grip.number == input.lease) else {
            return Heard::Foreign;
        };
        if input.made_ns < grip.granted_ns {
            return Heard::Foreign;
        }
        if grip.newest.is_some_and(|newest| input.sequence <= newest.sequence) {
            return Heard::Repeated;
        }
        grip.newest = Some(*input);
        // What comes late tells of the past: a switch counts when it is seen in time.
        if grip.age_s(now) <= terms.hover_s
            && let Some(on) = input.arm
        {
            match (grip.arm, on) {
                (Some(false), true) => grip.flip = Some(Flip::On),
                (Some(true), false) => grip.flip = Some(Flip::Off),
                _ => {}
            }
            grip.arm = Some(on);
        }
        Heard::Taken
    }

    /// Time passes; at most one state a step. Answers the age of the holder's newest input, seconds, when that has just
    /// ended the lease.
    pub fn step(&mut self, now: u64, under: Under, terms: &Terms) -> Option<f32> {
        let grip = self.grip.as_mut()?;
        let age_s = grip.age_s(now);
        if age_s >= terms.lease_s {
            self.grip = None;
            return Some(age_s);
        }
        let neutral = grip.newest.is_some_and(|input| input.axes.neutral(terms.neutral));
        let held = grip.newest.is_some_and(|input| input.held);
        grip.hand = if age_s > terms.hover_s - terms.spare_s {
            Hand::Silent
        } else {
            match (grip.hand, under) {
                (Hand::Silent | Hand::Free, _) | (_, Under::Other) => Hand::Stopping,
                (Hand::Stopping, Under::Ground | Under::Hand { stands: true }) => Hand::AwaitingNeutral,
                (Hand::AwaitingNeutral, _) if neutral => Hand::Ready,
                (Hand::Ready, Under::Hand { .. }) if held => Hand::Following,
                (Hand::Following, Under::Ground) => Hand::Ready,
                (Hand::Following, _) if !held => Hand::Ready,
                (hand, _) => hand,
            }
        };
        None
    }

    /// How far the holder has the drone in hand.
    #[must_use]
    pub fn hand(&self) -> Hand {
        self.grip.as_ref().map_or(Hand::Free, |grip| grip.hand)
    }

    /// Number of the lease; 0 while nobody holds it.
    #[must_use]
    pub fn number(&self) -> u64 {
        self.grip.as_ref().map_or(0, |grip| grip.number)
    }

    /// Who holds the sticks.
    #[must_use]
    pub fn holder(&self) -> Option<&W> {
        self.grip.as_ref().map(|grip| &grip.who)
    }

    /// Age of the holder's newest input, or of the grant before any, seconds; `None` without a holder.
    #[must_use]
    pub fn age_s(&self, now: u64) -> Option<f32> {
        self.grip.as_ref().map(|grip| grip.age_s(now))
    }

    /// What is to be followed; `None` in every state but [`Hand::Following`].
    #[must_use]
    pub fn followed(&self) -> Option<StickInput> {
        self.grip.as_ref().filter(|grip| grip.hand == Hand::Following).and_then(|grip| grip.newest)
    }

    /// How the arm switch was moved last, once.
    pub fn take_flip(&mut self) -> Option<Flip> {
        self.grip.as_mut().and_then(|grip| grip.flip.take())
    }
}
