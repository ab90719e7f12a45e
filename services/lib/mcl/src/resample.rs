//! Systematic resampling.

/// Writes for each of `out.len()` new particles the index of its ancestor, in ascending order: one draw
/// `u` in 0..1 places a comb with equal teeth over the cumulated weights (Kitagawa 1996), so a particle
/// of weight w has ⌊nw⌋ or ⌈nw⌉ children, which wanders least of all schemes.
///
/// Weights need not be normalised; when their sum is not a positive number (all zero, NaN) every
/// particle is treated alike. No weight at all: `out` is filled with zeros.
pub fn draw_ancestors(weights: &[f32], u: f32, out: &mut [u32]) {
    let n = out.len();
    let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
    if weights.is_empty() || n == 0 {
        out.fill(0);
        return;
    }
    if !(total.is_finite() && total > 0.0) {
        for (i, ancestor) in out.iter_mut().enumerate() {
            *ancestor = (i * weights.len() / n) as u32;
        }
        return;
    }
    let step = total / n as f64;
    let u = if (0.0..1.0).contains(&u) { f64::from(u) } else { 0.5 };
    let last = weights.len() - 1;
    let mut ancestor = 0;
    let mut reached = f64::from(weights[0]);
    for (i, slot) in out.iter_mut().enumerate() {
        let tooth = (i as f64 + u) * step;
        while reached < tooth && ancestor < last {
            ancestor += 1;
            reached += f64::from(weights[ancestor]);
        }
        *slot = ancestor as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::draw_ancestors;
    use proptest::prelude::*;

    #[test]
    fn children_are_in_proportion_to_weights() {
        let mut out = [0; 10];
        draw_ancestors(&[0.1, 0.0, 0.6, 0.3], 0.5, &mut out);
        assert_eq!(out, [0, 2, 2, 2, 2, 2, 2, 3, 3, 3]);
    }

    #[test]
    fn weights_without_a_sum_treat_all_alike() {
        for weights in [[0.0; 4], [f32::NAN; 4], [f32::INFINITY; 4]] {
            let mut out = [9; 8];
            draw_ancestors(&weights, 0.2, &mut out);
            assert_eq!(out, [0, 0, 1, 1, 2, 2, 3, 3]);
        }
        let mut out = [9; 2];
        draw_ancestors(&[], 0.2, &mut out);
        assert_eq!(out, [0, 0]);
    }

    proptest! {
        #[test]
        fn every_particle_has_floor_or_ceiling_children(
            weights in prop::collection::vec(0.0f32..1.0, 1..200), n in 1usize..400, u in 0.0f32..1.0,
        ) {
            let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
            prop_assume!(total > 1e-3);
            let mut out = vec![0; n];
            draw_ancestors(&weights, u, &mut out);
            prop_assert!(out.is_sorted());
            for (i, w) in weights.iter().enumerate() {
                let fair = f64::from(*w) / total * n as f64;
                let children = out.iter().filter(|a| **a as usize == i).count() as f64;
                prop_assert!((children - fair).abs() < 1.0 + 1e-6, "particle {i}: {children} for {fair}");
            }
        }
    }
}
