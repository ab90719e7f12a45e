//! scratch
#![allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]
use floorplan::*;
use std::sync::Arc;
struct Lot(u64);
impl Lot {
    fn draw(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1u64 << 24) as f32
    }
}
fn main() {
    for name in ["depot", "willow-full-0.05", "turtlebot3_world"] {
        let f = format!("../shared/maps/{name}.yaml");
        let h = PlanHeader::parse(&f, &std::fs::read(&f).unwrap()).unwrap();
        let img = std::fs::read(format!("../shared/maps/{}", h.image)).unwrap();
        let plan = Arc::new(Plan::load(&f, &h, &img).unwrap());
        let model = ConeModel::default();
        let t = ConeTable::new(plan.clone(), model).unwrap();
        let mut l = Lot(0x5eed_0001);
        let n = 100_000;
        let (mut both, mut off, mut one, mut asked) = (0, 0, 0, 0);
        let (w, hh) = (plan.width() as f32 * plan.resolution(), plan.height() as f32 * plan.resolution());
        while asked < n {
            let (x, y) = (plan.origin().0 + l.draw() * w, plan.origin().1 + l.draw() * hh);
            if plan.cell_at(x, y) != Cell::Free {
                continue;
            }
            asked += 1;
            let a = (l.draw() - 0.5) * std::f32::consts::TAU;
            let e = cast_cone(&plan, &model, x, y, a).unwrap_or(f32::INFINITY);
            let q = t.range(x, y, a);
            if e.is_finite() && q.is_finite() {
                both += 1;
                if (e - q).abs() > 2.0 * plan.resolution() {
                    off += 1;
                }
            } else if e.is_finite() != q.is_finite() {
                one += 1;
            }
        }
        println!(
            "{name}: both {both} off {off} ({:.2} % of both, {:.2} % of all) one-sided {one} ({:.2} %)",
            100.0 * off as f64 / both as f64,
            100.0 * off as f64 / n as f64,
            100.0 * one as f64 / n as f64
        );
    }
}
