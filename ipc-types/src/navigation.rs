//! `navigation/grid`, `navigation/polar`, `navigation/setpoint`, `navigation/patrol`.

use crate::Text;
use crate::code::codes;
use crate::field::{fields, message};

/// Cells along each side of the certainty grid (thesis 3.1: 81 of 5 cm, the drone in the middle).
pub const GRID_SIDE: usize = 81;
/// Cells of the certainty grid.
pub const GRID_CELLS: usize = GRID_SIDE * GRID_SIDE;
/// Sectors of the polar histogram (thesis equation 10: 72 of 5 degrees).
pub const SECTORS: usize = 72;
/// Most waypoints in a route.
pub const MAX_WAYPOINTS: usize = 1024;
/// Most rooms that are reported on.
pub const MAX_ROOMS: usize = 48;
/// Side of the bitmap of seen cells.
pub const SEEN_SIDE: usize = 512;

message! {
    /// The certainty grid: what the sonars have seen around the drone.
    pub struct Grid on "navigation/grid" {
        /// Plan frame, lower left corner of cell (0, 0).
        pub origin_x_m: f32,
        /// Plan frame, lower left corner of cell (0, 0).
        pub origin_y_m: f32,
        /// Side of a cell.
        pub cell_m: f32,
        /// Always zero.
        pub reserved: [u8; 11],
        /// Certainty, row by row from the lower left, x fastest.
        pub cells: [u8; 6561],
    }
}

codes! {
    /// Why a direction and speed were chosen.
    pub enum SteeringReason {
        /// No target: holding the place.
        Holding = 0 => "holding",
        /// The target's own sector is safe.
        TargetSafe = 1 => "straight at the target",
        /// The middle of a narrow valley (equation 15).
        NarrowValley = 2 => "through a narrow valley",
        /// Along the near border of a wide valley (equation 15).
        WideValley = 3 => "along a wide valley",
        /// No valley: stopped.
        Blocked = 4 => "blocked",
        /// No fresh pose or ranges: stopped.
        Blind = 5 => "no fresh pose or ranges",
        /// Something stands inside the safety distance: backing away.
        BackingOff = 6 => "backing away",
        /// What the pushes of a potential field leave of its pull.
        Deflected = 7 => "pushed aside by a potential field",
    }
}

message! {
    /// One decision of the Vector Field Histogram, or of the method in its place.
    pub struct Polar on "navigation/polar" {
        /// Polar obstacle density (equation 11); of a potential field the push away from what stands in the sector, m/s.
        /// Sector k looks along k * 5 degrees, plan frame.
        pub raw: [f32; 72],
        /// Smoothed density (equations 13, 14).
        pub smoothed: [f32; 72],
        /// 1 where the sector is blocked.
        pub blocked: [u8; 72],
        /// Threshold above which a free sector becomes blocked; NaN of a method without thresholds.
        pub threshold_high: f32,
        /// Threshold below which a blocked sector becomes free; NaN of a method without thresholds.
        pub threshold_low: f32,
        /// Direction of the target, plan frame; NaN without a target.
        pub target_rad: f32,
        /// Direction chosen, plan frame; NaN when stopped.
        pub chosen_rad: f32,
        /// Speed chosen.
        pub speed_m_s: f32,
        /// First sector of the chosen valley (inclusive), or 255.
        pub valley_first: u8,
        /// Last sector of the chosen valley (inclusive), or 255.
        pub valley_last: u8,
        /// A [`SteeringReason`] code.
        pub reason: u8,
        /// Always zero.
        pub reserved: u8,
    }
}

codes! {
    /// What navigation asks of the pilot.
    pub enum SetpointKind {
        /// Stand still in the air.
        Hover = 0 => "hover",
        /// Fly the velocity.
        Velocity = 1 => "velocity",
        /// Come down here: the route is flown and the pad is below.
        Land = 2 => "land",
    }
}

message! {
    /// The motion that navigation wishes; the pilot and the shield decide.
    pub struct Setpoint on "navigation/setpoint" {
        /// Not to be flown at or after this time. Later stages may only shorten it.
        pub expiry_ns: u64,
        /// Plan frame.
        pub velocity_x_m_s: f32,
        /// Plan frame.
        pub velocity_y_m_s: f32,
        /// Plan frame; NaN keeps the present heading.
        pub heading_rad: f32,
        /// Above the floor.
        pub height_m: f32,
        /// Place to hold, plan frame, for `Hover` and `Land`; NaN holds wherever it stops.
        pub hold_x_m: f32,
        /// See `hold_x_m`.
        pub hold_y_m: f32,
        /// A [`SetpointKind`] code.
        pub kind: u32,
        /// Always zero.
        pub reserved: u32,
    }
}

codes! {
    /// How the round is going.
    pub enum PatrolState {
        /// No round asked for.
        Idle = 0 => "idle",
        /// Working out the route, in slices.
        Planning = 1 => "planning",
        /// Flying it.
        Flying = 2 => "flying",
        /// Paused by the operator.
        Paused = 3 => "paused",
        /// On the way back to the pad.
        Returning = 4 => "returning",
        /// Over the pad, asking to land.
        Landing = 5 => "landing",
        /// Flown and landed.
        Done = 6 => "done",
        /// There is no way on.
        Failed = 7 => "failed",
        /// On the way to a place the operator named.
        GoingThere = 8 => "going there",
    }
}

codes! {
    /// How far a room has been seen.
    pub enum RoomState {
        /// Still to come.
        Waiting = 0 => "waiting",
        /// Being seen.
        Entered = 1 => "entered",
        /// Seen.
        Seen = 2 => "seen",
        /// Left out, with a reason.
        Skipped = 3 => "skipped",
        /// Nothing more of it can be seen in this round, with a reason.
        PartlySeen = 4 => "partly seen",
    }
}

fields! {
    /// One room of the round.
    pub struct RoomProgress {
        /// As in the sidecar file, or `Room 3`.
        pub name: Text<32>,
        /// Why it was skipped or seen in part only; empty otherwise.
        pub reason: Text<64>,
        /// Share of the room's cells seen, 0..1.
        pub seen: f32,
        /// A [`RoomState`] code.
        pub state: u32,
    }
}

fields! {
    /// One corner of the route.
    pub struct Waypoint {
        /// Plan frame.
        pub x_m: f32,
        /// Plan frame.
        pub y_m: f32,
        /// Index into `rooms`, or 255 for none.
        pub room: u8,
        /// Bit 0: passed. Bit 1: skipped. Bit 2: a place to look from (else only on the way).
        pub flags: u8,
        /// Always zero.
        pub reserved: u16,
    }
}

message! {
    /// The route, how far it is flown and what was left out: survives a restart of navigation.
    pub struct Patrol on "navigation/patrol" {
        /// When the round began.
        pub started_ns: u64,
        /// Stamp of the newest operator command heard; 0 before any.
        pub command_ns: u64,
        /// Filled waypoints; more than [`MAX_WAYPOINTS`] is a broken message.
        pub waypoints_used: u32,
        /// Next waypoint to reach.
        pub next: u32,
        /// Filled rooms; more than [`MAX_ROOMS`] is a broken message.
        pub rooms_used: u32,
        /// A [`PatrolState`] code.
        pub state: u32,
        /// Pad, plan frame.
        pub pad_x_m: f32,
        /// Pad, plan frame.
        pub pad_y_m: f32,
        /// Share of the cells to be seen that have been seen, 0..1.
        pub coverage: f32,
        /// Hash of the plan, folded to 32 bits: a route for another plan is not flown.
        pub plan: u32,
        /// Plan frame, lower left corner of the seen bitmap.
        pub seen_origin_x_m: f32,
        /// Plan frame, lower left corner of the seen bitmap.
        pub seen_origin_y_m: f32,
        /// Side of a bitmap cell.
        pub seen_cell_m: f32,
        /// Sequence of the last operator command heard: what `answer` is about, and what a restart does not obey twice.
        pub command_sequence: u32,
        /// For how long something has stood in the way, seconds: a restart goes on waiting where it was.
        pub waited_s: f32,
        /// An [`crate::Answer`] code: what became of the last command.
        pub answer: u32,
        /// Bit per point that the plan's side file names for the round, in its order: not flown to yet.
        pub points_waiting: u32,
        /// Bit per point: not flown to, for there is no way to it.
        pub points_barred: u32,
        /// The route.
        pub waypoints: [Waypoint; 1024],
        /// The rooms.
        pub rooms: [RoomProgress; 48],
        /// Bit per cell, row by row, x fastest, 512 x 512: near enough and in sight once.
        pub seen: [u64; 4096],
        /// Bit per cell of the same raster: something stands here that the plan does not show.
        pub unmapped: [u64; 4096],
        /// The answer in one sentence.
        pub answer_text: Text<96>,
        /// One sentence: what is being done and why.
        pub text: Text<128>,
    }
}
