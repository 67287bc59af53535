//! Dents of probes, read off tables at the points of a sheet.

use pulp::{Simd, WithSimd};

use crate::instructions::narrow;

/// Depth, and strain xx, yy, xy.
pub const PARTS: usize = 4;

/// Points that are looked at together.
const BLOCK: usize = 8;

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
    let mut sums = vec![[0.0; PARTS]; x.len()];
    let mut read = sums.clone();
    let mut near = vec![0; x.len()];
    for dent in dents {
        assert!(dent.table.len() == PARTS * dent.nodes * dent.nodes && dent.nodes > 1);
        narrow(Reading {
            dent,
            x,
            y,
            near: &mut near,
            read: &mut read,
            sums: &mut sums,
        });
    }
    for (part, felt) in felt.chunks_exact_mut(x.len()).enumerate() {
        for (felt, sums) in felt.iter_mut().zip(&sums) {
            *felt = sums[part];
        }
    }
}

struct Reading<'a> {
    dent: &'a Dent<'a>,
    x: &'a [f64],
    y: &'a [f64],
    /// Room for the numbers of points that are near.
    near: &'a mut [u32],
    /// Room for what is felt there.
    read: &'a mut [[f64; PARTS]],
    /// Of each point.
    sums: &'a mut [[f64; PARTS]],
}

impl WithSimd for Reading<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Dent {
            nodes,
            step,
            turn: [c, s],
            place,
            ..
        } = *self.dent;
        let squared = self.dent.reach * self.dent.reach;
        let mut count = 0;
        let mut first = 0;
        // neighbours in the order of the cells are neighbours on the sheet, as a rule
        for (xs, ys) in self.x.chunks(BLOCK).zip(self.y.chunks(BLOCK)) {
            let inside = |x: f64, y: f64| {
                let (x, y) = (x - place[0], y - place[1]);
                x * x + y * y < squared
            };
            let mut any = false;
            for (&x, &y) in xs.iter().zip(ys) {
                any |= inside(x, y);
            }
            if any {
                for (at, (&x, &y)) in (first..).zip(xs.iter().zip(ys)) {
                    self.near[count] = at; // written over unless it counts
                    count += usize::from(inside(x, y));
                }
            }
            first += xs.len() as u32;
        }
        let table = self.dent.table.as_chunks::<PARTS>().0;
        let (middle, scale) = ((nodes / 2) as f64, 1.0 / step);
        for (&at, read) in self.near[..count].iter().zip(&mut *self.read) {
            let at = at as usize;
            let (x, y) = (self.x[at] - place[0], self.y[at] - place[1]);
            let (x, y) = (
                (c * x + s * y) * scale + middle,
                (c * y - s * x) * scale + middle,
            );
            let (i, j) = (
                (x as i32 as usize).min(nodes - 2),
                (y as i32 as usize).min(nodes - 2),
            );
            let (right, up) = (x - i as f64, y - j as f64);
            let (low, high) = (
                &table[i * nodes + j..][..2],
                &table[(i + 1) * nodes + j..][..2],
            );
            let (low, high) = (
                between(&low[0], &low[1], up),
                between(&high[0], &high[1], up),
            );
            *read = between(&low, &high, right);
        }
        if s != 0.0 {
            for read in &mut self.read[..count] {
                *read = turned(*read, c, s);
            }
        }
        for (&at, read) in self.near[..count].iter().zip(&*self.read) {
            for (sum, part) in self.sums[at as usize].iter_mut().zip(read) {
                *sum += part;
            }
        }
    }
}

/// So far from `low` to `high`.
#[inline(always)]
fn between(low: &[f64; PARTS], high: &[f64; PARTS], part: f64) -> [f64; PARTS] {
    let mut out = *low;
    for ((out, low), high) in out.iter_mut().zip(low).zip(high) {
        *out += (high - low) * part;
    }
    out
}

/// The parts in axes that are turned back by an angle of this cosine and sine.
#[inline(always)]
fn turned([depth, xx, yy, xy]: [f64; PARTS], c: f64, s: f64) -> [f64; PARTS] {
    [
        depth,
        c * c * xx + s * s * yy - 2.0 * c * s * xy,
        s * s * xx + c * c * yy + 2.0 * c * s * xy,
        c * s * (xx - yy) + (c * c - s * s) * xy,
    ]
}
