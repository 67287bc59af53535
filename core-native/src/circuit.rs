//! What a board's amplifiers see of a sheet under each drive.

use pulp::{Simd, WithSimd};

use crate::instructions::narrow;

/// An amplifier and a converter.
#[derive(Clone, Copy, Debug)]
pub struct Converter {
    /// Of the amplifier.
    pub gain: f64,
    /// What the amplifier adds, V.
    pub offset: f64,
    /// Lowest and highest output of the amplifier, V.
    pub rails: [f64; 2],
    /// Codes per volt.
    pub scale: f64,
    /// Number of codes.
    pub levels: f64,
    /// Largest deviation from a straight line, in codes.
    pub bow: f64,
    /// Standard deviation of a conversion, in codes.
    pub noise: f64,
}

impl Converter {
    /// Writes the sum of all conversions of each sample.
    ///
    /// `volts` has one number a sample; `moving`: what comes to it, so many volts a sample, times
    /// one number a conversion: all samples of the first, then of the next, as `chance` has
    /// standard normal numbers.
    ///
    /// # Panics
    /// When a size is another.
    pub fn sums(self, volts: &[f64], moving: &[[&[f64]; 2]], chance: &[f64], out: &mut [u16]) {
        let n = out.len();
        assert!(n > 0 && chance.len().is_multiple_of(n) && volts.len() == n);
        for [size, course] in moving {
            assert!(size.len() == n && course.len() == chance.len());
        }
        narrow(Conversion {
            converter: self,
            volts,
            moving,
            chance,
            out,
        });
    }

    /// What the converter would say without noise, if it had all numbers.
    #[inline(always)]
    fn exact(&self, volts: f64) -> f64 {
        let output = (self.gain * volts + self.offset).max(self.rails[0]);
        let exact = output.min(self.rails[1]) * self.scale;
        let part = (exact * (1.0 / self.levels)).clamp(0.0, 1.0);
        exact + self.bow * 4.0 * part * (1.0 - part)
    }
}

struct Conversion<'a> {
    converter: Converter,
    volts: &'a [f64],
    moving: &'a [[&'a [f64]; 2]],
    chance: &'a [f64],
    out: &'a mut [u16],
}

impl WithSimd for Conversion<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (converter, n) = (self.converter, self.out.len());
        let mut exact = vec![0.0; n];
        let mut sums = vec![0.0; n];
        for (number, chance) in self.chance.chunks_exact(n).enumerate() {
            if number == 0 || !self.moving.is_empty() {
                exact.copy_from_slice(self.volts);
                for [size, course] in self.moving {
                    let course = &course[number * n..][..n];
                    for ((value, size), part) in exact.iter_mut().zip(*size).zip(course) {
                        *value += size * part;
                    }
                }
                for value in &mut exact {
                    *value = converter.exact(*value);
                }
            }
            for ((sum, exact), chance) in sums.iter_mut().zip(&exact).zip(chance) {
                let code = (converter.noise * chance + exact).floor();
                *sum += code.max(0.0).min(converter.levels - 1.0);
            }
        }
        for (out, sum) in self.out.iter_mut().zip(sums) {
            *out = sum as u16;
        }
    }
}

/// A current source, its switches and amplifiers.
#[derive(Clone, Copy, Debug)]
pub struct Circuit {
    /// Of the source, A.
    pub current: f64,
    /// Across the source, Ω.
    pub output: f64,
    /// Largest voltage of the source, V.
    pub compliance: f64,
    /// Of each switch, Ω.
    pub switch: f64,
    /// Part of the common mode that is read as well.
    pub common: f64,
    /// Part of the difference to each neighbouring channel that is read as well.
    pub neighbour: f64,
}

impl Circuit {
    /// Writes what each channel has against the sink's line, drive after drive.
    ///
    /// `contact`: what each contact has more than in the sheet's `resistance`, row-major.
    ///
    /// # Panics
    /// When a drive has an electrode that is not there, or a size is another.
    pub fn read(self, resistance: &[f64], contact: &[f64], drives: &[[usize; 2]], out: &mut [f64]) {
        let n = contact.len();
        assert!(resistance.len() == n * n && out.len() == drives.len() * n);
        let mut potential = vec![0.0; n];
        for (&[source, sink], out) in drives.iter().zip(out.chunks_exact_mut(n)) {
            let (from, to) = (&resistance[source * n..][..n], &resistance[sink * n..][..n]);
            let ground = from[sink] - to[sink];
            let extra = 2.0 * self.switch + contact[source] + contact[sink];
            let amperes = self.driven(from[source] - to[source] - ground + extra);
            for ((value, from), to) in potential.iter_mut().zip(from).zip(to) {
                *value = amperes * (from - to - ground) + amperes * contact[sink];
            }
            potential[sink] = 0.0;
            potential[source] += amperes * contact[source];
            let line = amperes * self.switch;
            for value in &mut potential {
                *value += (*value + 2.0 * line) / 2.0 * self.common;
            }
            out.copy_from_slice(&potential);
            for (at, pair) in potential.windows(2).enumerate() {
                let step = self.neighbour * (pair[1] - pair[0]);
                out[at] += step;
                out[at + 1] -= step;
            }
        }
    }

    /// A through a load of so many Ω.
    fn driven(self, load: f64) -> f64 {
        let amperes = self.current / (1.0 + load / self.output);
        amperes.min(self.compliance / load.max(1e-12))
    }
}
