//! Exact distances on a raster.

/// Squared distance in cells from each cell to the nearest marked one (Felzenszwalb and Huttenlocher 2012);
/// `f32::INFINITY` where nothing is marked.
pub(crate) fn squared_distances(width: usize, height: usize, marked: impl Fn(usize) -> bool) -> Vec<f32> {
    let mut field: Vec<f32> =
        (0..width * height).map(|i| if marked(i) { 0.0 } else { f32::INFINITY }).collect();
    let longest = width.max(height);
    let mut scratch =
        Scratch { values: vec![0.0; longest], parabolas: vec![0; longest], borders: vec![0.0; longest + 1] };
    for column in 0..width {
        for row in 0..height {
            scratch.values[row] = field[row * width + column];
        }
        scratch.lower_envelope(height, |row, value| field[row * width + column] = value);
    }
    for line in field.chunks_mut(width.max(1)) {
        scratch.values[..line.len()].copy_from_slice(line);
        scratch.lower_envelope(line.len(), |column, value| line[column] = value);
    }
    field
}

struct Scratch {
    values: Vec<f32>,
    parabolas: Vec<usize>,
    borders: Vec<f32>,
}

impl Scratch {
    fn lower_envelope(&mut self, length: usize, mut write: impl FnMut(usize, f32)) {
        let f = &self.values;
        let mut count = 0usize;
        for q in 0..length {
            if !f[q].is_finite() {
                continue;
            }
            let mut from = f32::NEG_INFINITY;
            while count > 0 {
                let p = self.parabolas[count - 1];
                let (qf, pf) = (q as f32, p as f32);
                from = ((f[q] + qf * qf) - (f[p] + pf * pf)) / (2.0 * (qf - pf));
                if from > self.borders[count - 1] {
                    break;
                }
                count -= 1;
                from = f32::NEG_INFINITY;
            }
            self.parabolas[count] = q;
            self.borders[count] = from;
            count += 1;
        }
        if count == 0 {
            return;
        }
        let mut k = 0;
        for i in 0..length {
            while k + 1 < count && self.borders[k + 1] < i as f32 {
                k += 1;
            }
            let p = self.parabolas[k];
            let d = i as f32 - p as f32;
            write(i, d * d + f[p]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_agree_with_a_search_of_all_cells() {
        let marks = [(3usize, 2usize), (11, 7), (0, 9), (11, 8)];
        let (w, h) = (13, 10);
        let field = squared_distances(w, h, |i| marks.contains(&(i % w, i / w)));
        for r in 0..h {
            for c in 0..w {
                let best = marks
                    .iter()
                    .map(|(mc, mr)| (c as f32 - *mc as f32).powi(2) + (r as f32 - *mr as f32).powi(2))
                    .fold(f32::INFINITY, f32::min);
                assert!((field[r * w + c] - best).abs() < 1e-3, "{c} {r}");
            }
        }
        assert!(squared_distances(3, 3, |_| false).iter().all(|d| d.is_infinite()));
    }
}
