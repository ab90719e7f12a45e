/// What somebody wants of a round besides that it shows everything by a short way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wishes {
    /// Rooms that are looked at before all others, in this order.
    pub first: Vec<usize>,
    /// Rooms that are not looked at. They may be flown through.
    pub leave_out: Vec<usize>,
    /// Places that are flown to in any case, plan frame, metres; `None` when that has been done.
    pub points: Vec<Option<(f32, f32)>>,
}

impl Wishes {
    /// Whether a room is not to be looked at.
    pub fn leaves_out(&self, room: Option<usize>) -> bool {
        room.is_some_and(|room| self.leave_out.contains(&room))
    }

    /// The lower, the sooner a room's turn comes.
    pub(crate) fn turn(&self, room: Option<usize>) -> usize {
        self.first.iter().position(|first| Some(*first) == room).unwrap_or(self.first.len())
    }
}
