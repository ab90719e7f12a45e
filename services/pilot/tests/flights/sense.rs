//! What the small aircraft tells the pilot.
#![allow(clippy::unwrap_used, reason = "tests")]

use crate::rig::{BEAM_REST, COMPASS, MOUNT, MS, REST, Rig};
use control::{Tilt, Vector};
use ipc_types::{
    Attitude, FlightState, FlowMotion, Pose, Power, SonarHealth, SonarRanges, SonarReading, SonarStatus,
};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

impl Rig {
    pub(crate) fn sense(&mut self) {
        let now = self.now;
        if self.steps % 5 < 3 {
            let noise = 0.002;
            let mut attitude = Attitude {
                roll_rad: self.tilt.roll + self.level.roll + noise * self.noise.normal(),
                pitch_rad: self.tilt.pitch + self.level.pitch + noise * self.noise.normal(),
                yaw_rad: control::wrap_angle(self.heading - COMPASS),
                sampled_ns: now,
                // A firmware that does not tell: without it everything must fly too.
                force_x_m_s2: if self.tells_force { 0.0 } else { f32::NAN },
                force_y_m_s2: if self.tells_force { 0.0 } else { f32::NAN },
                force_z_m_s2: if self.tells_force { self.force } else { f32::NAN },
                ..Default::default()
            };
            attitude.header.stamp_ns = now;
            self.core.attitude(&attitude);
        }
        if self.steps.is_multiple_of(10) {
            let mut state = FlightState {
                armed: u8::from(self.armed),
                link: self.link_state.code(),
                arming_blocks: self.blocks,
                ladder: self.ladder.code(),
                ..Default::default()
            };
            if self.blocks != 0 {
                state.reason.set("will not arm: no gyro");
            }
            state.channels_us[2] = self.channels.channels_us[2];
            state.header.stamp_ns = now;
            self.core.flight_state(&state);
        }
        if self.power_told && self.steps.is_multiple_of(25) {
            let mut power = Power {
                volts: 4.0 * self.cell_volts,
                cells: 4,
                amps: 11.0,
                drawn_mah: self.drawn_mah,
                ..Default::default()
            };
            power.header.stamp_ns = now;
            self.core.power(&power);
        }
        self.sense_pose();
        if self.beam && self.steps.is_multiple_of(2) {
            // VL53L0X class: 1 % and 6 mm.
            let above = self.height - self.surface + BEAM_REST;
            let noise = (0.006 + 0.01 * above) * self.noise.normal();
            let range_m = above / self.tilt.magnitude().cos() + noise;
            let mut flow = FlowMotion { ranged_ns: now, range_m, ..Default::default() };
            flow.header.stamp_ns = now;
            self.core.flow(&flow);
        }
        self.sense_ranges();
        if self.steps % 3 == 1
            && let Some(setpoint) = &mut self.setpoint
        {
            setpoint.header.stamp_ns = now;
            setpoint.expiry_ns = now + 250 * MS;
            self.core.setpoint(setpoint);
        }
    }

    fn sense_pose(&mut self) {
        if matches!(self.steps % 5, 0 | 3) {
            let mut n = || self.noise.normal();
            let known = if self.level_known { self.level } else { Tilt::default() };
            self.poses.push_back(Pose {
                estimated_ns: self.now,
                x_m: self.place.x + 0.02 * n(),
                y_m: self.place.y + 0.02 * n(),
                heading_rad: self.heading,
                velocity_x_m_s: self.velocity.x + 0.05 * n(),
                velocity_y_m_s: self.velocity.y + 0.05 * n(),
                variance_x_m2: 0.0016,
                variance_y_m2: 0.0016,
                velocity_sigma_m_s: 0.07,
                heading_offset_rad: COMPASS,
                air_x_m_s2: f32::NAN,
                air_y_m_s2: f32::NAN,
                level_roll_rad: known.roll,
                level_pitch_rad: known.pitch,
                p_lost: 0.001,
                state: self.pose_state.code().into(),
                walls_in_echo: self.walls_in_echo,
                adrift_ns: self.adrift_ns,
                ..Default::default()
            });
        }
        while self.poses.front().is_some_and(|p| self.now >= p.estimated_ns + 60 * MS) {
            let mut pose = self.poses.pop_front().unwrap();
            pose.header.stamp_ns = self.now;
            if !self.localization_dead {
                self.core.pose(&pose);
            }
        }
    }

    fn reading(&self, sensor: u8, bearing: f32, elevation: f32) -> SonarReading {
        SonarReading {
            ping_ns: self.now,
            range_m: f32::NAN,
            bearing_rad: bearing,
            elevation_rad: elevation,
            mount_x_m: 0.0,
            mount_y_m: 0.0,
            mount_z_m: 0.0,
            sensor,
            status: SonarStatus::NoEcho.code(),
            health: SonarHealth::Good.code(),
            reserved: [0; 5],
        }
    }

    fn side_range(&self, bearing: f32) -> Option<f32> {
        let angle = self.heading + bearing;
        let face = self.place + Vector::along(angle) * MOUNT;
        (-3..=3)
            .filter_map(|ray| self.plan.cast_ray(face.x, face.y, angle + ray as f32 * 0.087, 4.0))
            .filter(|hit| hit.incidence_rad.abs() < 0.5)
            .map(|hit| hit.range_m)
            .min_by(f32::total_cmp)
    }

    fn sense_ranges(&mut self) {
        if self.steps.is_multiple_of(3) {
            let mut ranges = SonarRanges { sweep_s: 0.24, sensors: 9, ..Default::default() };
            let pair = (self.steps / 3 % 4) as u8;
            let mut filled = 0;
            for sensor in [pair, pair + 4] {
                let bearing = f32::from(sensor) * FRAC_PI_4;
                let mut reading = self.reading(sensor, bearing, 0.0);
                if let Some(range) = self.side_range(bearing) {
                    reading.range_m = range + 0.006 * self.noise.normal();
                    reading.status = SonarStatus::Ok.code();
                }
                if self.sides_dead {
                    reading.status = SonarStatus::Fault.code();
                }
                ranges.readings[filled] = reading;
                filled += 1;
            }
            let mut down = self.reading(8, 0.0, -FRAC_PI_2);
            down.health = self.down_health.code();
            if self.noise.unit() >= self.down_lost {
                let below = if self.noise.unit() < 0.5 { self.surface.max(self.edge) } else { self.surface };
                down.range_m = self.height - below + REST + 0.005 * self.noise.normal();
                down.range_m = down.range_m.max(0.021);
                down.status = SonarStatus::Ok.code();
            }
            ranges.readings[filled] = down;
            ranges.count = filled as u32 + 1;
            self.echoes.push_back((self.now, ranges));
        }
        while self.echoes.front().is_some_and(|(at, _)| self.now >= at + 62 * MS) {
            let (_, ranges) = self.echoes.pop_front().unwrap();
            self.core.ranges(&ranges);
        }
    }
}
