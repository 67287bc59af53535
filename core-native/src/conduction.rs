//! How a sheet under load conducts: what its cells remember of the load, and what follows from it.
//!
//! A load has two groups of components, each with its own plays: strain xx, yy, xy, and
//! compression. Cells are taken abreast, as many as a register holds.

use pulp::{Arch, Simd, WithSimd};

use crate::abreast::{Abreast, Reals, exp};
use crate::instructions::run;

/// Components of a load.
pub const LOADS: usize = 4;
/// Groups of them.
pub const GROUPS: usize = 2;

/// What depends on the past, in the time of one step.
#[derive(Clone, Copy, Debug)]
pub struct Memory<'a> {
    /// Parts that lag, and the half widths of their plays.
    pub play: &'a [(f64, f64)],
    /// What each late part keeps of its lateness.
    pub late: &'a [f64],
    /// What each breakdown keeps.
    pub broken: &'a [f64],
}

/// What cells remember: of each part, component after component, in each all cells.
#[derive(Clone, Copy, Debug)]
pub struct Past<'a> {
    /// The load as it was last.
    pub load: &'a [f64],
    /// Where each play stands.
    pub lagging: &'a [f64],
    /// What each late part has reached.
    pub late: &'a [f64],
    /// Motion of which each breakdown has not recovered, of each group.
    pub broken: &'a [f64],
    /// Mean strain, summed over all loading; empty where it is of no use.
    pub worn: &'a [f64],
}

/// What cells remember after a step; as [`Past`], and the part of the load that is answered at once.
#[derive(Debug)]
pub struct Present<'a> {
    /// See [`Past`].
    pub lagging: &'a mut [f64],
    /// What is answered at once.
    pub prompt: &'a mut [f64],
    /// See [`Past`].
    pub late: &'a mut [f64],
    /// See [`Past`].
    pub broken: &'a mut [f64],
    /// See [`Past`].
    pub worn: &'a mut [f64],
}

/// Goes on by one step under a `load`.
///
/// # Panics
/// When an array is too short.
pub fn advance(memory: Memory<'_>, load: &[f64], past: Past<'_>, present: Present<'_>) {
    run(
        Arch::new(),
        Step {
            memory,
            load,
            past,
            present,
        },
    );
}

struct Step<'a> {
    memory: Memory<'a>,
    load: &'a [f64],
    past: Past<'a>,
    present: Present<'a>,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (memory, past, present) = (self.memory, self.past, self.present);
        let n = self.load.len() / LOADS;
        let rows = Abreast { simd, n };
        let own = rows.all(1.0 - memory.play.iter().map(|&(part, _)| part).sum::<f64>());
        for at in rows.begins() {
            let load = rows.four(self.load, 0, at);
            let mut prompt = [own * load[0], own * load[1], own * load[2], own * load[3]];
            for (number, &(part, width)) in memory.play.iter().enumerate() {
                let lagging = rows.four(past.lagging, number * LOADS, at);
                let lagging = dragged(lagging, load, rows.all(width));
                for d in 0..LOADS {
                    rows.write(present.lagging, number * LOADS + d, at, lagging[d]);
                    prompt[d] = prompt[d] + rows.all(part) * lagging[d];
                }
            }
            for (d, &prompt) in prompt.iter().enumerate() {
                rows.write(present.prompt, d, at, prompt);
                for (number, &kept) in memory.late.iter().enumerate() {
                    let row = number * LOADS + d;
                    let late = rows.read(past.late, row, at);
                    let late = (late - prompt) * rows.all(kept) + prompt;
                    rows.write(present.late, row, at, late);
                }
            }
            if memory.broken.is_empty() && past.worn.is_empty() {
                continue;
            }
            let last = rows.four(past.load, 0, at);
            let moved = [
                load[0] - last[0],
                load[1] - last[1],
                load[2] - last[2],
                load[3] - last[3],
            ];
            if !past.worn.is_empty() {
                let rise = (moved[0] + moved[1]) * rows.all(0.5);
                let worn = rows.read(past.worn, 0, at) + rise.max(rows.all(0.0));
                rows.write(present.worn, 0, at, worn);
            }
            let moved = sizes(moved);
            for (number, &kept) in memory.broken.iter().enumerate() {
                for (group, &moved) in moved.iter().enumerate() {
                    let row = number * GROUPS + group;
                    let broken = rows.read(past.broken, row, at);
                    rows.write(present.broken, row, at, (broken + moved) * rows.all(kept));
                }
            }
        }
    }
}

/// Plays of half widths `width` behind a load.
#[inline(always)]
fn dragged<S: Simd>(
    lagging: [Reals<S>; LOADS],
    load: [Reals<S>; LOADS],
    width: Reals<S>,
) -> [Reals<S>; LOADS] {
    let [a, b, c, d] = lagging;
    let slack = [a - load[0], b - load[1], c - load[2], d - load[3]];
    let [strain, compression] = sizes(slack);
    let (strain, compression) = (width / strain.max(width), width / compression.max(width));
    [
        slack[0] * strain + load[0],
        slack[1] * strain + load[1],
        slack[2] * strain + load[2],
        slack[3] * compression + load[3],
    ]
}

/// √((xx² + yy²)/2 + xy²), and the size of the compression.
#[inline(always)]
fn sizes<S: Simd>([xx, yy, xy, compression]: [Reals<S>; LOADS]) -> [Reals<S>; GROUPS] {
    let half = xx.all(0.5);
    let strain = xx * xx * half + yy * yy * half + xy * xy;
    [strain.sqrt(), compression.abs()]
}

/// How load changes conduction.
#[derive(Clone, Copy, Debug)]
pub struct Material<'a> {
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
    /// Parts that come late.
    pub creep: &'a [f64],
    /// Mean strains per motion.
    pub breakdown: &'a [f64],
    /// Largest compression.
    pub most_compression: f64,
    /// Largest change of the logarithm.
    pub most_log: f64,
}

/// What the conductivity of each cell follows from.
#[derive(Clone, Copy, Debug)]
pub struct Cause<'a> {
    /// See [`Present`].
    pub prompt: &'a [f64],
    /// See [`Present`].
    pub late: &'a [f64],
    /// See [`Present`].
    pub broken: &'a [f64],
    /// Wear of each cell.
    pub worn: &'a [f64],
    /// Conductivity of each cell without load.
    pub unloaded: &'a [f64],
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

/// Writes the conductivity of all cells; where directions differ, xx, xy, yx, yy after each other.
///
/// # Panics
/// When an array is too short.
pub fn conductivity(material: Material<'_>, cause: Cause<'_>, out: &mut [f64]) {
    run(
        Arch::new(),
        Conducting {
            material,
            cause,
            out,
        },
    );
}

struct Conducting<'a> {
    material: Material<'a>,
    cause: Cause<'a>,
    out: &'a mut [f64],
}

impl WithSimd for Conducting<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (cause, material) = (self.cause, self.material);
        let n = cause.unloaded.len();
        let rows = Abreast { simd, n };
        let (least, cold) = (rows.all(LEAST), rows.all(1.0 / material.heat.max(LEAST)));
        for at in rows.begins() {
            let [xx, yy, xy, squeezed] = followed(rows, &material, &cause, at);
            let rise = risen(rows, &material, &cause, at, xx + yy);
            let squeezed = squeezed.bounded(rows.all(material.most_compression));
            let factor = rows.all(1.0) + rows.all(material.compression) * squeezed;
            let level = rows.read(cause.unloaded, 0, at) * factor.max(least) * cold;
            if material.gauge_across == 0.0 {
                rows.write(self.out, 0, at, level * exp(rise));
                continue;
            }
            let across = rows.all(material.gauge_across);
            let (half, cross) = (across * (xx - yy) * rows.all(0.5), across * xy);
            let tensor = directed(level, [rise, half, cross], material.most_log);
            for (row, part) in [0, 1, 1, 2].into_iter().enumerate() {
                rows.write(self.out, row, at, tensor[part]);
            }
        }
    }
}

/// The load that is answered: with plays and creep.
#[inline(always)]
fn followed<S: Simd>(
    rows: Abreast<S>,
    material: &Material<'_>,
    cause: &Cause<'_>,
    at: usize,
) -> [Reals<S>; LOADS] {
    let own = rows.all(1.0 - material.creep.iter().sum::<f64>());
    let mut total = rows.four(cause.prompt, 0, at);
    for total in &mut total {
        *total = own * *total;
    }
    for (number, &part) in material.creep.iter().enumerate() {
        let late = rows.four(cause.late, number * LOADS, at);
        for (total, late) in total.iter_mut().zip(late) {
            *total = *total + rows.all(part) * late;
        }
    }
    total
}

/// Change of the logarithm, for all directions alike; `strain` is the sum of both.
#[inline(always)]
fn risen<S: Simd>(
    rows: Abreast<S>,
    material: &Material<'_>,
    cause: &Cause<'_>,
    at: usize,
    strain: Reals<S>,
) -> Reals<S> {
    let mut rise = strain;
    for (number, &part) in material.breakdown.iter().enumerate() {
        let broken = rows.read(cause.broken, number * GROUPS, at);
        rise = rise + rows.all(2.0 * part) * broken;
    }
    rise = rise * rows.all(-material.gauge / 2.0);
    if material.wear != 0.0 {
        rise = rise - rows.all(material.wear) * rows.read(cause.worn, 0, at);
    }
    rise.bounded(rows.all(material.most_log))
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
