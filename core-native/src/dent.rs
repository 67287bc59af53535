//! Dents of probes, read off tables at the points of a sheet.

use pulp::{Simd, WithSimd};

use crate::instructions::narrow;

/// Strain xx, yy, xy, and depth.
pub const PARTS: usize = 4;

/// The dent of a probe, on a square grid around it, and where that is.
#[derive(Clone, Copy, Debug)]
pub struct Dent<'a> {
    /// The parts at each node, row by row: `nodes` rows of as many.
    pub table: &'a [f64],
    /// Nodes along each side.
    pub nodes: usize,
    /// From node to node.
    pub step: f64,
    /// Farther from the probe than this, nothing is felt; within the grid.
    pub reach: f64,
    /// The probe's place.
    pub place: [f64; 2],
    /// Cosine and sine of the angle by which it is turned.
    pub turn: [f64; 2],
}

/// Writes what all dents together are at points given by `x` and `y`, part after part.
///
/// # Panics
/// When a table is smaller than it says, or `felt` has another size.
pub fn add(dents: &[Dent<'_>], x: &[f64], y: &[f64], felt: &mut [f64]) {
    assert!(y.len() == x.len() && felt.len() == PARTS * x.len());
    felt.fill(0.0);
    let (mut far, mut near) = (vec![0.0; x.len()], vec![0; x.len() + 1]);
    for dent in dents {
        assert!(dent.table.len() == PARTS * dent.nodes * dent.nodes && dent.nodes > 1);
        narrow(Reading {
            dent,
            x,
            y,
            far: &mut far,
            near: &mut near,
            felt,
        });
    }
}

struct Reading<'a> {
    dent: &'a Dent<'a>,
    x: &'a [f64],
    y: &'a [f64],
    /// Room for squares of distances.
    far: &'a mut [f64],
    /// Room for the numbers of points that are near, and one more.
    near: &'a mut [u32],
    /// What is added to.
    felt: &'a mut [f64],
}

impl WithSimd for Reading<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let count = self.find();
        let Dent {
            table,
            nodes,
            step,
            turn: [c, s],
            place,
            ..
        } = *self.dent;
        let (middle, scale) = ((nodes / 2) as f64, 1.0 / step);
        let last = nodes as i32 - 2;
        let n = self.x.len();
        let (strain, depth) = self.felt.split_at_mut(3 * n);
        let (xx, strain) = strain.split_at_mut(n);
        let (yy, xy) = strain.split_at_mut(n);
        for &at in &self.near[..count] {
            let at = at as usize;
            let (x, y) = (self.x[at] - place[0], self.y[at] - place[1]);
            let right = (c * x + s * y) * scale + middle;
            let up = (c * y - s * x) * scale + middle;
            let (i, j) = ((right as i32).clamp(0, last), (up as i32).clamp(0, last));
            let corners = &table[PARTS * (i as usize * nodes + j as usize)..];
            let part = [right - f64::from(i), up - f64::from(j)];
            let mut read = between(simd, corners, PARTS * nodes, part);
            if s != 0.0 {
                read = turned(read, c, s);
            }
            xx[at] += read[0];
            yy[at] += read[1];
            xy[at] += read[2];
            depth[at] += read[3];
        }
    }
}

impl Reading<'_> {
    /// Finds what is near, and gives the number of these points.
    #[inline(always)]
    fn find(&mut self) -> usize {
        let Dent { reach, place, .. } = *self.dent;
        for ((far, x), y) in self.far.iter_mut().zip(self.x).zip(self.y) {
            let (x, y) = (x - place[0], y - place[1]);
            *far = x * x + y * y;
        }
        let mut count = 0;
        for (at, &far) in (0..).zip(&*self.far) {
            self.near[count] = at; // written over unless it counts
            count += usize::from(far < reach * reach);
        }
        count
    }
}

/// The parts at a point within a square of nodes, from the first two of which the others are `row`
/// numbers away.
#[inline(always)]
fn between<S: Simd>(simd: S, corners: &[f64], row: usize, part: [f64; 2]) -> [f64; PARTS] {
    const { assert!(PARTS.is_multiple_of(S::F64_LANES)) }
    let (near, next) = (&corners[..2 * PARTS], &corners[row..][..2 * PARTS]);
    let [near, next] = [near, next].map(|nodes| S::as_simd_f64s(nodes).0);
    let [right, up] = part.map(|part| simd.splat_f64s(part));
    let way = |from, to, part| simd.mul_add_e_f64s(simd.sub_f64s(to, from), part, from);
    let mut out = [0.0; PARTS];
    let half = near.len() / 2;
    for (k, out) in S::as_mut_simd_f64s(&mut out).0.iter_mut().enumerate() {
        let (low, high) = (
            way(near[k], near[half + k], up),
            way(next[k], next[half + k], up),
        );
        *out = way(low, high, right);
    }
    out
}

/// The parts in axes that are turned back by an angle of this cosine and sine.
#[inline(always)]
fn turned([xx, yy, xy, depth]: [f64; PARTS], c: f64, s: f64) -> [f64; PARTS] {
    [
        c * c * xx + s * s * yy - 2.0 * c * s * xy,
        s * s * xx + c * c * yy + 2.0 * c * s * xy,
        c * s * (xx - yy) + (c * c - s * s) * xy,
        depth,
    ]
}
