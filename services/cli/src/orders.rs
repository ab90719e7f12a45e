//! Orders to the drone, and what those who must obey them answer.

pub use runtime::orders::{Orders, Replies, Reply, next_order_number, obeyed_by};
