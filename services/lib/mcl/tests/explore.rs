#![allow(clippy::unwrap_used, reason = "tests")]
mod world;
use world::*;
#[test]
fn explore() {
    let world = World::new();
    type F = fn(&mut mcl::Config);
    let variants: &[(&str, F)] = &[ ("new", |_| {}), ("new.temper.35", |c| c.sonar.temper = 0.35), ("max2000", |c| c.population.max=2000), ("err.04", |c| c.population.error=0.04),
];
    let _old: &[(&str, F)] = &[
        ("base", |_| {}),
        ("temper1", |c| c.sonar.temper = 1.0),
        ("temper.4", |c| c.sonar.temper = 0.4),
        ("min2000", |c| c.population.min = 2000),
        ("velnoise.45", |c| c.motion.velocity_noise = 0.45),
        ("velnoise.25", |c| c.motion.velocity_noise = 0.25),
        ("pos.06", |c| c.motion.position_noise = 0.06),
        ("sigma.07", |c| c.sonar.sigma = 0.07),
        ("floor.03", |c| c.sonar.floor = 0.03),
        ("floor.005", |c| c.sonar.floor = 0.005),
        ("unexp.2", |c| c.sonar.unexpected = 0.2),
        ("missed.2", |c| c.sonar.missed = 0.2),
        ("heading.1", |c| {c.motion.heading_noise_per_m = 0.1;}),
        ("heading.03", |c| {c.motion.heading_noise_per_m = 0.03;}),
        ("thr.8", |c| {c.resample.threshold = 0.8;}),
    ];
    for flow in [false,true] {
    for (name, f) in variants {
        let mut t = Trial { flow, ..Trial::default() };
        f(&mut t.config);
        let logs: Vec<Log> = std::thread::scope(|s| {
            let h: Vec<_> = (1..9).map(|seed| { let t = t.clone(); let w = &world; s.spawn(move || fly(w, &Trial { seed, ..t })) }).collect();
            h.into_iter().map(|h| h.join().unwrap()).collect()
        });
        let p95: Vec<String> = logs.iter().map(|l| format!("{:.2}", l.quantile(0.95, |m| m.error))).collect();
        let all = Log(logs.into_iter().flat_map(|l| l.0).collect());
        eprintln!("per seed p95 {p95:?}");
        all.print(&format!("{name} flow {flow}"));
    }}
}
