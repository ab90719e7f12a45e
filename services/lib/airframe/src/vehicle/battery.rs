//! A lithium-polymer pack: open-circuit voltage by charge, internal resistance, capacity.

/// What a pack is.
#[derive(Clone, Copy, Debug)]
pub struct Pack {
    /// In series.
    pub cells: u32,
    /// Milliampere-hours.
    pub capacity_mah: f64,
    /// Of the whole pack, ohm.
    pub resistance_ohm: f64,
    /// Volts of one full cell at rest.
    pub full_cell_v: f64,
}

/// Open-circuit volts of one cell that is full at 4.2 V, by share of charge left (the usual shape of a
/// lithium-polymer discharge curve at rest).
const OPEN_CIRCUIT: [(f64, f64); 11] = [
    (0.0, 3.00),
    (0.05, 3.45),
    (0.1, 3.57),
    (0.2, 3.67),
    (0.3, 3.72),
    (0.4, 3.76),
    (0.5, 3.80),
    (0.6, 3.84),
    (0.75, 3.94),
    (0.9, 4.08),
    (1.0, 4.20),
];

/// A pack in use.
#[derive(Clone, Debug)]
pub struct Battery {
    pack: Pack,
    charge: f64,
    volts: f64,
    amps: f64,
    wear: Wear,
}

/// What has gone wrong with a pack.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wear {
    /// Resistance on top of the pack's own: an old pack, a loose plug, ohm.
    pub extra_ohm: f64,
    /// Cells that give nothing any more.
    pub lost_cells: u32,
}

impl Battery {
    /// A full pack.
    #[must_use]
    pub fn new(pack: Pack) -> Self {
        let volts = f64::from(pack.cells) * pack.full_cell_v;
        Self { pack, charge: 1.0, volts, amps: 0.0, wear: Wear::default() }
    }

    /// Draws `watts` for `dt` seconds.
    pub fn draw(&mut self, watts: f64, dt: f64) {
        let open = f64::from(self.pack.cells.saturating_sub(self.wear.lost_cells)) * self.open_cell_volts();
        // The current follows the voltage of the step before: one millisecond late, no equation to solve.
        self.amps = watts / self.volts.max(1.0);
        self.volts = (open - self.amps * (self.pack.resistance_ohm + self.wear.extra_ohm)).max(1.0);
        let drawn_mah = self.amps * dt / 3.6;
        self.charge = (self.charge - drawn_mah / self.pack.capacity_mah).max(0.0);
    }

    fn open_cell_volts(&self) -> f64 {
        let scale = self.pack.full_cell_v / 4.2;
        let mut below = OPEN_CIRCUIT[0];
        for above in OPEN_CIRCUIT {
            if self.charge <= above.0 {
                let span = above.0 - below.0;
                let part = if span > 0.0 { (self.charge - below.0) / span } else { 0.0 };
                return scale * (below.1 + part * (above.1 - below.1));
            }
            below = above;
        }
        scale * below.1
    }

    /// At the terminals.
    #[must_use]
    pub fn volts(&self) -> f64 {
        self.volts
    }
    /// Drawn now.
    #[must_use]
    pub fn amps(&self) -> f64 {
        self.amps
    }
    /// Share of the charge left, 0..=1.
    #[must_use]
    pub fn charge(&self) -> f64 {
        self.charge
    }
    /// Starts from another share of charge than full.
    pub fn set_charge(&mut self, charge: f64) {
        self.charge = charge.clamp(0.0, 1.0);
        self.volts = f64::from(self.pack.cells) * self.open_cell_volts();
    }
    /// Goes on with what has gone wrong.
    pub(crate) fn set_wear(&mut self, wear: Wear) {
        self.wear = wear;
    }
    /// What is left sinks to `charge`, if there was more: cells that held less than their label says.
    pub(crate) fn sink_to(&mut self, charge: f64) {
        self.charge = self.charge.min(charge.clamp(0.0, 1.0));
    }
    /// Milliampere-hours drawn since full.
    #[must_use]
    pub fn drawn_mah(&self) -> f64 {
        (1.0 - self.charge) * self.pack.capacity_mah
    }
    /// Terminal voltage over that of a full pack at rest: what scales the motors' speed.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.volts / (f64::from(self.pack.cells) * self.pack.full_cell_v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loaded_pack_sags_and_empties_by_the_charge_drawn() {
        let mut battery =
            Battery::new(Pack { cells: 4, capacity_mah: 1000.0, resistance_ohm: 0.05, full_cell_v: 4.2 });
        assert!((battery.volts() - 16.8).abs() < 1e-9);
        for _ in 0..1000 {
            battery.draw(160.0, 0.001);
        }
        // About 10 A: half a volt of sag, 2.8 mAh in one second.
        assert!((battery.volts() - 16.3).abs() < 0.1, "{}", battery.volts());
        assert!((battery.drawn_mah() - 2.73).abs() < 0.1, "{}", battery.drawn_mah());
        for _ in 0..400_000 {
            battery.draw(160.0, 0.001);
        }
        assert!(battery.charge() <= 0.0 && battery.volts() > 0.0 && battery.volts() < 12.0);
    }
    #[test]
    fn a_worn_pack_sags_deeper_and_a_lost_cell_takes_its_share() {
        let pack = Pack { cells: 4, capacity_mah: 1000.0, resistance_ohm: 0.05, full_cell_v: 4.2 };
        let volts = |wear| {
            let mut battery = Battery::new(pack);
            battery.set_wear(wear);
            (0..100).for_each(|_| battery.draw(100.0, 0.001));
            battery.volts()
        };
        let sound = volts(Wear::default());
        // 100 W are about 6 A, which lose 0.6 V in 0.1 ohm; a full cell has 4.2 V.
        let sagging = sound - volts(Wear { extra_ohm: 0.1, lost_cells: 0 });
        assert!((0.5..0.8).contains(&sagging), "{sagging}");
        let short = sound - volts(Wear { extra_ohm: 0.0, lost_cells: 1 });
        assert!((4.2..4.5).contains(&short), "{short}");
    }
}
