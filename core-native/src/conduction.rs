//! How a sheet under load conducts: what its cells remember of the load, and what follows from it.
//!
//! A load has two groups of components, each with its own plays: strain xx, yy, xy, and depth. Cells
//! are taken abreast, as many as a register holds, and all that is asked of them in one pass.

use pulp::{Arch, Simd, WithSimd};

use crate::abreast::{Block, Reals, Rows, exp};
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

/// What cells feel: component after component, in each all cells.
#[derive(Clone, Copy, Debug)]
pub struct Load<'a> {
    /// Now.
    pub now: &'a [f64],
    /// As it was last.
    pub last: &'a [f64],
}

/// What cells remember: of each part, component after component, in each all cells.
#[derive(Debug)]
pub struct Memory<'a> {
    /// Where each play stands.
    pub lagging: &'a mut [f64],
    /// What each late part has reached.
    pub late: &'a mut [f64],
    /// Motion of which each breakdown has not recovered, of each group.
    pub broken: &'a mut [f64],
    /// Mean strain, summed over all loading; empty where it is of no use.
    pub worn: &'a mut [f64],
}

/// Goes on by one step, and writes the conductivity of all cells, of which `unloaded` is that
/// without load; where directions differ, xx, xy, yx, yy after each other.
///
/// What is remembered is written where it lies.
///
/// # Panics
/// When an array is too short.
pub fn advance(
    material: Material<'_>,
    load: Load<'_>,
    memory: Memory<'_>,
    unloaded: &[f64],
    conductivity: &mut [f64],
) {
    let n = unloaded.len();
    let rows = if material.gauge_across == 0.0 {
        1
    } else {
        LOADS
    };
    let worn = usize::from(!memory.worn.is_empty());
    let left = |parts: &[(f64, f64)]| 1.0 - parts.iter().map(|&(part, _)| part).sum::<f64>();
    let cells = Cells {
        material,
        own: left(material.play),
        prompt: left(material.creep),
        per_depth: 1.0 / material.thickness,
        cold: 1.0 / material.heat.max(LEAST),
        n,
        load: Rows::new(load.now, LOADS, n),
        last: Rows::new(load.last, LOADS, n),
        lagging: Rows::new(memory.lagging, LOADS * material.play.len(), n),
        late: Rows::new(memory.late, LOADS * material.creep.len(), n),
        broken: Rows::new(memory.broken, GROUPS * material.breakdown.len(), n),
        worn: Rows::new(memory.worn, worn, n),
        unloaded: Rows::new(unloaded, 1, n),
        conductivity: Rows::new(conductivity, rows, n),
    };
    run(Arch::new(), cells);
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

struct Cells<'a> {
    material: Material<'a>,
    /// What plays leave of a load, and creep of what follows.
    own: f64,
    prompt: f64,
    /// Compression per depth.
    per_depth: f64,
    /// By heat.
    cold: f64,
    n: usize,
    load: Rows<&'a [f64]>,
    last: Rows<&'a [f64]>,
    lagging: Rows<&'a mut [f64]>,
    late: Rows<&'a mut [f64]>,
    broken: Rows<&'a mut [f64]>,
    worn: Rows<&'a mut [f64]>,
    unloaded: Rows<&'a [f64]>,
    conductivity: Rows<&'a mut [f64]>,
}

impl WithSimd for Cells<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let whole = self.n - self.n % S::F64_LANES;
        for at in (0..whole).step_by(S::F64_LANES) {
            self.go_on(Block::<S, true> { simd, at });
        }
        if whole < self.n {
            self.go_on(Block::<S, false> { simd, at: whole });
        }
    }
}

impl Cells<'_> {
    /// Goes on by one step in the cells of a block.
    #[inline(always)]
    fn go_on<S: Simd, const WHOLE: bool>(&mut self, block: Block<S, WHOLE>) {
        let material = self.material;
        let load = block.four(&self.load, 0);
        let [xx, yy, xy, depth] = self.followed(block, load);
        let rise = self.risen(block, load, xx + yy);
        let squeezed = depth * block.all(self.per_depth);
        let squeezed = squeezed.bounded(block.all(material.most_compression));
        let factor = block.all(1.0) + block.all(material.compression) * squeezed;
        let cold = block.all(self.cold);
        let level = block.read(&self.unloaded, 0) * factor.max(block.all(LEAST)) * cold;
        if material.gauge_across == 0.0 {
            block.write(&mut self.conductivity, 0, level * exp(rise));
            return;
        }
        let across = block.all(material.gauge_across);
        let (half, cross) = (across * (xx - yy) * block.all(0.5), across * xy);
        let tensor = directed(level, [rise, half, cross], material.most_log);
        for (row, part) in [0, 1, 1, 2].into_iter().enumerate() {
            block.write(&mut self.conductivity, row, tensor[part]);
        }
    }

    /// The load that is answered: with plays and creep, which go on.
    #[inline(always)]
    fn followed<S: Simd, const WHOLE: bool>(
        &mut self,
        block: Block<S, WHOLE>,
        load: [Reals<S>; LOADS],
    ) -> [Reals<S>; LOADS] {
        let Material { play, creep, .. } = self.material;
        let mut prompt = scaled(block.all(self.own), load);
        for (number, &(part, width)) in play.iter().enumerate() {
            let lagging = block.four(&self.lagging, number * LOADS);
            let lagging = dragged(lagging, load, width, self.per_depth);
            for d in 0..LOADS {
                block.write(&mut self.lagging, number * LOADS + d, lagging[d]);
                prompt[d] = prompt[d] + block.all(part) * lagging[d];
            }
        }
        let mut total = scaled(block.all(self.prompt), prompt);
        for (number, &(part, kept)) in creep.iter().enumerate() {
            for d in 0..LOADS {
                let row = number * LOADS + d;
                let late = block.read(&self.late, row);
                let late = (late - prompt[d]) * block.all(kept) + prompt[d];
                block.write(&mut self.late, row, late);
                total[d] = total[d] + block.all(part) * late;
            }
        }
        total
    }

    /// Change of the logarithm, for all directions alike, as breakdown and wear go on; `strain` is
    /// the sum of both that are answered.
    #[inline(always)]
    fn risen<S: Simd, const WHOLE: bool>(
        &mut self,
        block: Block<S, WHOLE>,
        load: [Reals<S>; LOADS],
        strain: Reals<S>,
    ) -> Reals<S> {
        let material = self.material;
        let mut rise = strain;
        if !material.breakdown.is_empty() {
            let moved = apart(load, block.four(&self.last, 0));
            let moved = sizes(moved, self.per_depth);
            for (number, &(part, kept)) in material.breakdown.iter().enumerate() {
                for (group, &moved) in moved.iter().enumerate() {
                    let row = number * GROUPS + group;
                    let broken = block.read(&self.broken, row);
                    let broken = (broken + moved) * block.all(kept);
                    block.write(&mut self.broken, row, broken);
                    if group == 0 {
                        rise = rise + block.all(2.0 * part) * broken;
                    }
                }
            }
        }
        rise = rise * block.all(-material.gauge / 2.0);
        if !self.worn.is_empty() {
            let [xx, yy] = [0, 1].map(|row| load[row] - block.read(&self.last, row));
            let more = ((xx + yy) * block.all(0.5)).max(block.all(0.0));
            let worn = block.read(&self.worn, 0) + more;
            block.write(&mut self.worn, 0, worn);
            rise = rise - block.all(material.wear) * worn;
        }
        rise.bounded(block.all(material.most_log))
    }
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
