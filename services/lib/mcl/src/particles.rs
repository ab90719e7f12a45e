//! The particle set as columns.

use thiserror::Error;

/// A particle set to be read: columns of equal length, one entry a particle.
#[derive(Clone, Copy, Debug)]
pub struct ParticlesRef<'a> {
    /// Plan frame, metres.
    pub x: &'a [f32],
    /// Plan frame, metres.
    pub y: &'a [f32],
    /// Plan frame, metres a second.
    pub velocity_x: &'a [f32],
    /// Plan frame, metres a second.
    pub velocity_y: &'a [f32],
    /// Plan heading minus compass yaw, radians, -π..=π.
    pub heading_offset: &'a [f32],
    /// What the roll reading is when the body is level, radians.
    pub level_roll: &'a [f32],
    /// What the pitch reading is when the body is level, radians.
    pub level_pitch: &'a [f32],
    /// Normalised weights (equation 4).
    pub weight: &'a [f32],
}

/// Room for a particle set: columns at least as long as the set to be written.
#[derive(Debug)]
pub struct ParticlesMut<'a> {
    /// Plan frame, metres.
    pub x: &'a mut [f32],
    /// Plan frame, metres.
    pub y: &'a mut [f32],
    /// Plan frame, metres a second.
    pub velocity_x: &'a mut [f32],
    /// Plan frame, metres a second.
    pub velocity_y: &'a mut [f32],
    /// Plan heading minus compass yaw, radians.
    pub heading_offset: &'a mut [f32],
    /// Level error of roll, radians.
    pub level_roll: &'a mut [f32],
    /// Level error of pitch, radians.
    pub level_pitch: &'a mut [f32],
    /// Normalised weights.
    pub weight: &'a mut [f32],
}

/// Why a particle set that came from elsewhere cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ParticlesError {
    /// Nothing in it.
    #[error("the particle set is empty")]
    Empty,
    /// Columns of different length.
    #[error("the particle set's columns differ in length: {shortest} and {longest}")]
    Ragged {
        /// Entries of the shortest column.
        shortest: usize,
        /// Entries of the longest column.
        longest: usize,
    },
    /// NaN, infinite or absurdly large.
    #[error("the particle set's column {column} holds {value}; allowed: -{limit}..={limit}")]
    Value {
        /// Name of the column.
        column: &'static str,
        /// What was found.
        value: f32,
        /// Largest size allowed.
        limit: f32,
    },
    /// The weights do not add up.
    #[error("the particle weights sum to {sum}; allowed: 0.99..=1.01")]
    Weights {
        /// Their sum.
        sum: f32,
    },
}

impl<'a> ParticlesRef<'a> {
    fn columns(&self) -> [(&'static str, &'a [f32], f32); 8] {
        // Limits: no building is 100 km long, no indoor drone does 100 m/s, angles are wrapped.
        [
            ("x", self.x, 1e5),
            ("y", self.y, 1e5),
            ("velocity_x", self.velocity_x, 100.0),
            ("velocity_y", self.velocity_y, 100.0),
            ("heading_offset", self.heading_offset, 7.0),
            ("level_roll", self.level_roll, 2.0),
            ("level_pitch", self.level_pitch, 2.0),
            ("weight", self.weight, 1.01),
        ]
    }

    /// Entries of the shortest column.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns().iter().map(|c| c.1.len()).min().unwrap_or(0)
    }

    /// Whether there is no particle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Looks through a set that came from elsewhere (a crash, another version): equal lengths, finite
    /// values, weights that sum to one. A pass over all columns: for the start, not for every update.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn check(&self) -> Result<usize, ParticlesError> {
        let columns = self.columns();
        let shortest = self.len();
        let longest = columns.iter().map(|c| c.1.len()).max().unwrap_or(0);
        if longest == 0 {
            return Err(ParticlesError::Empty);
        }
        if shortest != longest {
            return Err(ParticlesError::Ragged { shortest, longest });
        }
        for (column, values, limit) in columns {
            // `!(<=)` also catches NaN.
            if let Some(value) = values.iter().find(|v| v.is_nan() || v.abs() > limit) {
                return Err(ParticlesError::Value { column, value: *value, limit });
            }
        }
        if let Some(value) = self.weight.iter().find(|w| **w < 0.0) {
            return Err(ParticlesError::Value { column: "weight", value: *value, limit: 1.01 });
        }
        let sum = self.weight.iter().sum::<f32>();
        if !(0.99..=1.01).contains(&sum) {
            return Err(ParticlesError::Weights { sum });
        }
        Ok(shortest)
    }

    /// The same set with columns cut to `n`, so that loops over them need no bounds checks.
    pub(crate) fn first(&self, n: usize) -> Self {
        Self {
            x: &self.x[..n],
            y: &self.y[..n],
            velocity_x: &self.velocity_x[..n],
            velocity_y: &self.velocity_y[..n],
            heading_offset: &self.heading_offset[..n],
            level_roll: &self.level_roll[..n],
            level_pitch: &self.level_pitch[..n],
            weight: &self.weight[..n],
        }
    }
}

impl ParticlesMut<'_> {
    /// Particles that fit: entries of the shortest column.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.first_ref().len()
    }

    fn first_ref(&self) -> ParticlesRef<'_> {
        ParticlesRef {
            x: self.x,
            y: self.y,
            velocity_x: self.velocity_x,
            velocity_y: self.velocity_y,
            heading_offset: self.heading_offset,
            level_roll: self.level_roll,
            level_pitch: self.level_pitch,
            weight: self.weight,
        }
    }

    /// The first `n` particles, to be read. `n` beyond the capacity reads as many as there are.
    #[must_use]
    pub fn written(&self, n: usize) -> ParticlesRef<'_> {
        self.first_ref().first(n.min(self.capacity()))
    }

    /// Particles `from..to`, to be written.
    pub(crate) fn part(&mut self, from: usize, to: usize) -> ParticlesMut<'_> {
        ParticlesMut {
            x: &mut self.x[from..to],
            y: &mut self.y[from..to],
            velocity_x: &mut self.velocity_x[from..to],
            velocity_y: &mut self.velocity_y[from..to],
            heading_offset: &mut self.heading_offset[from..to],
            level_roll: &mut self.level_roll[from..to],
            level_pitch: &mut self.level_pitch[from..to],
            weight: &mut self.weight[from..to],
        }
    }
}
