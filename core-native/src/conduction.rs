//! How a sheet under load conducts: what its cells remember of the load, and what follows from it.
//!
//! A load has two groups of components, each with its own plays: strain xx, yy, xy, and depth. Cells
//! are taken abreast, as many as a register holds, and in one pass: memory is what most time goes to.

use pulp::{Arch, Simd, WithSimd};

use crate::abreast::{Abreast, Reals, exp};
use crate::instructions::run;

/// Components of a load.
pub const LOADS: usize = 4;
/// Groups of them.
pub const GROUPS: usize = 2;

/// How load changes conduction, in the time of one step.
#[derive(Clone, Copy, Debug)]
pub struct Material<'a> {
    /// Parts that lag, and the half widths of their plays.
    pub play: &'a [(f64, f64)],
    /// Parts that come late, and what each keeps of its lateness.
    pub creep: &'a [(f64, f64)],
    /// Mean strain per motion of each breakdown, and what it keeps.
    pub breakdown: &'a [(f64, f64)],
    /// Of the layer whose compression is the depth.
    pub thickness: f64,
    /// Fall of the logarithm per mean strain.
    pub gauge: f64,
    /// The same per deviator; zero: no direction differs from another.
    pub gauge_across: f64,
    /// Rise per compression.
    pub compression: f64,
    /// Fall of the logarithm per wear.
    pub wear: f64,
    /// By which all is divided.
    pub heat: f64,
    /// Largest compression.
    pub most_compression: f64,
    /// Largest change of the logarithm.
    pub most_log: f64,
}

/// What cells feel, and remember: of each part, component after component, in each all cells.
#[derive(Clone, Copy, Debug)]
pub struct Past<'a> {
    /// The load now.
    pub load: &'a [f64],
    /// The load as it was last.
    pub last: &'a [f64],
    /// Where each play stood.
    pub lagging: &'a [f64],
    /// What each late part had reached.
    pub late: &'a [f64],
    /// Motion of which each breakdown had not recovered, of each group.
    pub broken: &'a [f64],
    /// Mean strain, summed over all loading; empty where it is of no use.
    pub worn: &'a [f64],
    /// Conductivity of each cell without load.
    pub unloaded: &'a [f64],
}

/// What cells remember after a step, as [`Past`]; and how they conduct.
#[derive(Debug)]
pub struct Present<'a> {
    /// See [`Past`].
    pub lagging: &'a mut [f64],
    /// See [`Past`].
    pub late: &'a mut [f64],
    /// See [`Past`].
    pub broken: &'a mut [f64],
    /// See [`Past`].
    pub worn: &'a mut [f64],
    /// Conductivity of each cell; where directions differ, xx, xy, yx, yy after each other.
    pub conductivity: &'a mut [f64],
}

/// Goes on by one step.
///
/// # Panics
/// When an array is too short.
pub fn advance(material: Material<'_>, past: Past<'_>, present: Present<'_>) {
    run(
        Arch::new(),
        Step {
            material,
            past,
            present,
        },
    );
}

/// Least factor of compression or heat.
const LEAST: f64 = 1e-3;
/// A deviator below is none.
const NONE: f64 = 1e-12;
/// Squares of deviators for which these series have all digits: cosh √x, and sinh √x / √x.
const SMALL: f64 = 0.25;
const COSH: [f64; 8] = [
    1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    1.0 / 720.0,
    1.0 / 24.0,
    0.5,
    1.0,
];
const SINH: [f64; 8] = [
    1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    1.0 / 5_040.0,
    1.0 / 120.0,
    1.0 / 6.0,
    1.0,
];

struct Step<'a> {
    material: Material<'a>,
    past: Past<'a>,
    present: Present<'a>,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let n = self.past.unloaded.len();
        let whole = n - n % S::F64_LANES;
        for at in (0..whole).step_by(S::F64_LANES) {
            self.block(Abreast::<S, true> { simd, n }, at);
        }
        if whole < n {
            self.block(Abreast::<S, false> { simd, n }, whole);
        }
    }
}

impl Step<'_> {
    /// The cells of one block.
    #[inline(always)]
    fn block<S: Simd, const WHOLE: bool>(&mut self, rows: Abreast<S, WHOLE>, at: usize) {
        let material = self.material;
        let load = rows.four(self.past.load, 0, at);
        let [xx, yy, xy, depth] = self.followed(rows, load, at);
        let rise = self.risen(rows, load, xx + yy, at);
        let squeezed = depth * rows.all(1.0 / material.thickness);
        let squeezed = squeezed.bounded(rows.all(material.most_compression));
        let factor = rows.all(1.0) + rows.all(material.compression) * squeezed;
        let unloaded = rows.read(self.past.unloaded, 0, at);
        let cold = rows.all(1.0 / material.heat.max(LEAST));
        let level = unloaded * factor.max(rows.all(LEAST)) * cold;
        let out = &mut *self.present.conductivity;
        if material.gauge_across == 0.0 {
            rows.write(out, 0, at, level * exp(rise));
            return;
        }
        let across = rows.all(material.gauge_across);
        let (half, cross) = (across * (xx - yy) * rows.all(0.5), across * xy);
        let tensor = directed(level, [rise, half, cross], material.most_log);
        for (row, part) in [0, 1, 1, 2].into_iter().enumerate() {
            rows.write(out, row, at, tensor[part]);
        }
    }

    /// The load that is answered: with plays and creep, which go on.
    #[inline(always)]
    fn followed<S: Simd, const WHOLE: bool>(
        &mut self,
        rows: Abreast<S, WHOLE>,
        load: [Reals<S>; LOADS],
        at: usize,
    ) -> [Reals<S>; LOADS] {
        let (Material { play, creep, .. }, past) = (self.material, self.past);
        let mut prompt = scaled(rest(rows, play), load);
        for (number, &(part, width)) in play.iter().enumerate() {
            let lagging = rows.four(past.lagging, number * LOADS, at);
            let lagging = dragged(lagging, load, width, 1.0 / self.material.thickness);
            for d in 0..LOADS {
                let row = number * LOADS + d;
                rows.write(self.present.lagging, row, at, lagging[d]);
                prompt[d] = prompt[d] + rows.all(part) * lagging[d];
            }
        }
        let mut total = scaled(rest(rows, creep), prompt);
        for (number, &(part, kept)) in creep.iter().enumerate() {
            for d in 0..LOADS {
                let row = number * LOADS + d;
                let late = rows.read(past.late, row, at);
                let late = (late - prompt[d]) * rows.all(kept) + prompt[d];
                rows.write(self.present.late, row, at, late);
                total[d] = total[d] + rows.all(part) * late;
            }
        }
        total
    }

    /// Change of the logarithm, for all directions alike, as breakdown and wear go on; `strain` is
    /// the sum of both that are answered.
    #[inline(always)]
    fn risen<S: Simd, const WHOLE: bool>(
        &mut self,
        rows: Abreast<S, WHOLE>,
        load: [Reals<S>; LOADS],
        strain: Reals<S>,
        at: usize,
    ) -> Reals<S> {
        let (material, past) = (self.material, self.past);
        let mut rise = strain;
        if !material.breakdown.is_empty() {
            let moved = apart(load, rows.four(past.last, 0, at));
            let moved = sizes(moved, 1.0 / material.thickness);
            for (number, &(part, kept)) in material.breakdown.iter().enumerate() {
                for (group, &moved) in moved.iter().enumerate() {
                    let row = number * GROUPS + group;
                    let broken = rows.read(past.broken, row, at);
                    let broken = (broken + moved) * rows.all(kept);
                    rows.write(self.present.broken, row, at, broken);
                    if group == 0 {
                        rise = rise + rows.all(2.0 * part) * broken;
                    }
                }
            }
        }
        rise = rise * rows.all(-material.gauge / 2.0);
        if !past.worn.is_empty() {
            let [xx, yy] = [0, 1].map(|row| load[row] - rows.read(past.last, row, at));
            let more = ((xx + yy) * rows.all(0.5)).max(rows.all(0.0));
            let worn = rows.read(past.worn, 0, at) + more;
            rows.write(self.present.worn, 0, at, worn);
            rise = rise - rows.all(material.wear) * worn;
        }
        rise.bounded(rows.all(material.most_log))
    }
}

/// What these parts leave of a whole.
#[inline(always)]
fn rest<S: Simd, const WHOLE: bool>(rows: Abreast<S, WHOLE>, parts: &[(f64, f64)]) -> Reals<S> {
    rows.all(1.0 - parts.iter().map(|&(part, _)| part).sum::<f64>())
}

#[inline(always)]
fn scaled<S: Simd>(by: Reals<S>, [a, b, c, d]: [Reals<S>; LOADS]) -> [Reals<S>; LOADS] {
    [by * a, by * b, by * c, by * d]
}

#[inline(always)]
fn apart<S: Simd>(one: [Reals<S>; LOADS], other: [Reals<S>; LOADS]) -> [Reals<S>; LOADS] {
    let ([a, b, c, d], [e, f, g, h]) = (one, other);
    [a - e, b - f, c - g, d - h]
}

/// Plays of half widths `width` behind a load.
#[inline(always)]
fn dragged<S: Simd>(
    lagging: [Reals<S>; LOADS],
    load: [Reals<S>; LOADS],
    width: f64,
    per_depth: f64,
) -> [Reals<S>; LOADS] {
    let slack = apart(lagging, load);
    let width = slack[0].all(width);
    let [strain, compression] = sizes(slack, per_depth);
    let (strain, compression) = (width / strain.max(width), width / compression.max(width));
    [
        slack[0] * strain + load[0],
        slack[1] * strain + load[1],
        slack[2] * strain + load[2],
        slack[3] * compression + load[3],
    ]
}

/// √((xx² + yy²)/2 + xy²), and the size of the compression, which is so much per depth.
#[inline(always)]
fn sizes<S: Simd>([xx, yy, xy, depth]: [Reals<S>; LOADS], per_depth: f64) -> [Reals<S>; GROUPS] {
    let half = xx.all(0.5);
    let strain = xx * xx * half + yy * yy * half + xy * xy;
    [strain.sqrt(), (depth * depth.all(per_depth)).abs()]
}

/// xx, xy, yy of level · exp(rise − [[half, cross], [cross, −half]]), a matrix exponential.
#[inline(always)]
fn directed<S: Simd>(
    level: Reals<S>,
    [rise, half, cross]: [Reals<S>; 3],
    most: f64,
) -> [Reals<S>; 3] {
    let square = half.times_plus(half, cross * cross);
    if square.below(SMALL) {
        let level = level * exp(rise);
        let (mean, slope) = (level * square.series(&COSH), level * square.series(&SINH));
        return [
            mean - slope * half,
            level.all(0.0) - slope * cross,
            mean + slope * half,
        ];
    }
    let size = square.sqrt().max(level.all(NONE));
    let bounded = size.min(level.all(most));
    let level = level * level.all(0.5);
    let (up, down) = (level * exp(rise + bounded), level * exp(rise - bounded));
    let (mean, slope) = (up + down, (up - down) / size);
    [
        mean - slope * half,
        level.all(0.0) - slope * cross,
        mean + slope * half,
    ]
}
