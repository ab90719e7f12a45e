//! Which face each pixel shows, and how far away it is.

use super::look::{Look, NEAR_M, dot};
use super::scene::Scene;
use super::shapes::{Face, MOST_CORNERS, Mesh};

/// No face.
pub(super) const NOTHING: u32 = u32::MAX;
/// Corners of a face after clipping: the near plane may add one.
const CLIPPED: usize = MOST_CORNERS + 1;

/// The picture before it is painted.
#[derive(Debug, Default)]
pub(super) struct Raster {
    width: usize,
    height: usize,
    /// One over the distance ahead, 1/m: linear across a face in the picture. 0: nothing there.
    nearness: Vec<f32>,
    faces: Vec<u32>,
    /// First and last column of the face that is being filled, a row.
    spans: Vec<(f32, f32)>,
    order: Vec<(f32, bool, u32)>,
}

impl Raster {
    pub(super) fn clear(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        let pixels = width * height;
        self.nearness.clear();
        self.nearness.resize(pixels, 0.0);
        self.faces.clear();
        self.faces.resize(pixels, NOTHING);
        self.spans.resize(height, (0.0, 0.0));
    }

    /// The faces of a row and how near they are.
    pub(super) fn row(&self, row: usize) -> (&[u32], &[f32]) {
        let range = row * self.width..(row + 1) * self.width;
        (&self.faces[range.clone()], &self.nearness[range])
    }

    /// Draws all bodies that may be seen, the nearest first: what is hidden is then looked at and not written.
    pub(super) fn draw(&mut self, scene: &Scene, look: &Look, doors_shut: u64) {
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        for (walking, mesh) in [(false, &scene.still), (true, &scene.walking)] {
            for (index, body) in mesh.bodies.iter().enumerate() {
                let hidden = body.door.is_some_and(|door| doors_shut >> door & 1 == 0);
                let middle = look.place(body.middle);
                if !hidden && look.may_see(middle, body.radius) {
                    order.push((middle[2] - body.radius, walking, index as u32));
                }
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for (_, walking, index) in &order {
            let (mesh, base) =
                if *walking { (&scene.walking, scene.still.faces.len()) } else { (&scene.still, 0) };
            let Some(body) = mesh.bodies.get(*index as usize) else { continue };
            for number in body.first..body.last {
                if let Some(face) = mesh.faces.get(number as usize) {
                    self.fill(mesh, face, base as u32 + number, look);
                }
            }
        }
        self.order = order;
    }

    fn fill(&mut self, mesh: &Mesh, face: &Face, number: u32, look: &Look) {
        let corners = &mesh.points[face.first as usize..face.first as usize + usize::from(face.corners)];
        let Some(first) = corners.first() else { return };
        // Negative when the face looks towards the lens.
        let offset = dot(face.normal, std::array::from_fn(|k| first[k] - look.eye[k]));
        if offset > -1e-5 {
            return;
        }
        let mut clipped = [[0.0; 3]; CLIPPED];
        let count = clip(corners, look, &mut clipped);
        let Some(rows) = self.outline(&clipped[..count], look) else { return };
        // On the face, normal . (nearness-scaled ray) = offset: one over the distance is linear in column and row.
        let normal = look.turn(face.normal);
        let scale = 1.0 / (offset * look.focal);
        let (per_column, per_row) = (normal[0] * scale, -normal[1] * scale);
        let middle = normal[2] / offset - per_column * look.middle.0 - per_row * look.middle.1;
        for row in rows {
            let (left, right) = self.spans[row];
            let begin = (left - 0.5).ceil().max(0.0) as usize;
            let end = ((right - 0.5).ceil().max(0.0) as usize).min(self.width);
            if begin >= end {
                continue;
            }
            let start = middle + per_row * (row as f32 + 0.5) + per_column * (begin as f32 + 0.5);
            let range = row * self.width + begin..row * self.width + end;
            let pixels = self.nearness[range.clone()].iter_mut().zip(&mut self.faces[range]);
            for (k, (nearness, shown)) in pixels.enumerate() {
                let here = start + per_column * k as f32;
                let nearer = here > *nearness;
                *nearness = if nearer { here } else { *nearness };
                *shown = if nearer { number } else { *shown };
            }
        }
    }

    /// Sets the spans of the rows that a clipped face (right, up, ahead) covers.
    fn outline(&mut self, corners: &[[f32; 3]], look: &Look) -> Option<std::ops::Range<usize>> {
        let mut flat = [(0.0f32, 0.0f32); CLIPPED];
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        let (mut left, mut right) = (f32::MAX, f32::MIN);
        for (place, [x, y, z]) in flat.iter_mut().zip(corners) {
            let scale = look.focal / z;
            *place = (look.middle.0 + x * scale, look.middle.1 - y * scale);
            (low, high) = (low.min(place.1), high.max(place.1));
            (left, right) = (left.min(place.0), right.max(place.0));
        }
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let last = ((high - 0.5).ceil().max(0.0) as usize).min(self.height);
        if corners.len() < 3 || first >= last || right < 0.0 || left > self.width as f32 {
            return None;
        }
        self.spans[first..last].fill((f32::MAX, f32::MIN));
        let flat = &flat[..corners.len()];
        for (k, a) in flat.iter().enumerate() {
            let b = flat[(k + 1) % flat.len()];
            let (upper, lower) = if a.1 < b.1 { (*a, b) } else { (b, *a) };
            let begin = (upper.1 - 0.5).ceil().max(0.0) as usize;
            let end = ((lower.1 - 0.5).ceil().max(0.0) as usize).min(self.height);
            if begin >= end {
                continue;
            }
            let slope = (lower.0 - upper.0) / (lower.1 - upper.1);
            for (row, span) in self.spans[begin..end].iter_mut().enumerate() {
                let x = upper.0 + ((begin + row) as f32 + 0.5 - upper.1) * slope;
                *span = (span.0.min(x), span.1.max(x));
            }
        }
        Some(first..last)
    }
}

/// The part of a face before the near plane, as right, up and ahead (Sutherland and Hodgman 1974).
fn clip(corners: &[[f32; 3]], look: &Look, out: &mut [[f32; 3]; CLIPPED]) -> usize {
    let mut count = 0;
    let mut put = |place: [f32; 3]| {
        if let Some(slot) = out.get_mut(count) {
            *slot = place;
            count += 1;
        }
    };
    let Some(last) = corners.last() else { return 0 };
    let mut before = look.place(*last);
    for corner in corners {
        let here = look.place(*corner);
        if (before[2] < NEAR_M) != (here[2] < NEAR_M) {
            let t = (NEAR_M - before[2]) / (here[2] - before[2]);
            put(std::array::from_fn(|k| if k == 2 { NEAR_M } else { before[k] + t * (here[k] - before[k]) }));
        }
        if here[2] >= NEAR_M {
            put(here);
        }
        before = here;
    }
    count
}
