//! What stands for the exact model of several spots, and how wrong it may be.
//!
//! As `Reduced` in tomoskin/sensing/fit/certificate.py.

use crate::dense::Matrix;
use crate::small::{dots, product};
use crate::spot_table::Spot;

/// A spot's height over the squared distance from its middle.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Where it ends, in radii, and its content, in squared radii.
    pub reach: f64,
    /// See there.
    pub filling: f64,
    /// Of the spot with a tail: scales up to its end.
    pub scales: f64,
    /// Squared reaches of a bell in one of that; its height; how far a spot is on the way to it.
    pub bell: [f64; 3],
}

impl Profile {
    /// At squared distances in squared reaches.
    fn height(&self, square: f64) -> f64 {
        let [narrow, height, part] = self.bell;
        let inside = square.min(1.0);
        let (scales, taper) = (self.scales * inside.sqrt(), 1.0 - inside.powi(3));
        let tail = (1.0 + scales) * (-scales).exp() * taper * taper;
        let bell = height * (1.0 - narrow * square).max(0.0).powi(3);
        (tail + part * (bell - tail)) / (1.0 + part * (height - 1.0))
    }
}

/// The fields in patches of a sheet.
#[derive(Debug)]
pub struct Interaction {
    /// Of spots.
    pub profile: Profile,
    /// (p) m of the patches.
    pub centres: Vec<[f64; 2]>,
    /// m², added to the second moment of a spot.
    pub spread: f64,
    /// (2p, electrodes) of 1 A into each electrode, both axes of a patch one after the other.
    pub fields: Vec<f32>,
    /// (2p, 2p) of dipoles in all patches.
    pub between: Vec<f32>,
}

/// The field of each electrode times what a spot changes: entries of `fields`, and (these,
/// electrodes) by columns.
struct Scattered {
    entries: Vec<usize>,
    fields: Matrix<f64>,
}

impl Interaction {
    /// (electrodes, electrodes) by which spots together change the transfer resistance, less what
    /// each does alone.
    pub fn change(&self, spots: &[Spot]) -> Matrix<f64> {
        let n = self.fields.len() / (2 * self.centres.len());
        let each: Vec<_> = spots.iter().map(|spot| self.scattered(spot, n)).collect();
        let mut total = Matrix::zeros(n, n);
        for (number, own) in each.iter().enumerate() {
            for earlier in &each[..number] {
                self.add(&mut total, earlier, own);
            }
        }
        Matrix::from_fn(n, n, |i, j| total[(i, j)] + total[(j, i)])
    }

    fn scattered(&self, spot: &Spot, n: usize) -> Scattered {
        let square = (2.0 * spot[2]).exp() + self.spread;
        let Profile { reach, filling, .. } = self.profile;
        let (mut entries, mut heights) = (Vec::new(), Vec::new());
        for (patch, [x, y]) in self.centres.iter().enumerate() {
            let away = (x - spot[0]).powi(2) + (y - spot[1]).powi(2);
            let far = away / (reach * reach * square);
            if far < 1.0 {
                let height = self.profile.height(far) * spot[3] / (filling * square);
                entries.extend([2 * patch, 2 * patch + 1]);
                heights.extend([height; 2]);
            }
        }
        let fields = Matrix::from_fn(entries.len(), n, |i, electrode| {
            heights[i] * f64::from(self.fields[entries[i] * n + electrode])
        });
        Scattered { entries, fields }
    }

    /// What two spots do to each other, one way.
    fn add(&self, total: &mut Matrix<f64>, one: &Scattered, other: &Scattered) {
        let (height, all) = (one.entries.len(), 2 * self.centres.len());
        if height == 0 || other.entries.is_empty() {
            return;
        }
        let between = Matrix::from_fn(height, other.entries.len(), |i, j| {
            f64::from(self.between[one.entries[i] * all + other.entries[j]])
        });
        let carried = product(&between.values, height, &other.fields.values);
        let both = dots(&one.fields.values, &carried.values, height);
        let sums = total.values.iter_mut().zip(&both.values);
        sums.for_each(|(sum, value)| *sum += value);
    }
}

/// How wrong a table is: seen at some spots.
#[derive(Debug)]
pub struct Certificate {
    /// (n, 2): how far each was from the rim, in median radii, and the logarithm of its radius in
    /// these.
    pub like: Vec<[f64; 2]>,
    /// (n) squared errors, in parts of what each changes.
    pub squares: Vec<f64>,
    /// How many of them tell of a spot.
    pub neighbours: usize,
    /// So many times what these show, an error is at the most.
    pub margin: f64,
    /// Error beside, of a table that was moved to an uneven sheet.
    pub moved: f64,
    /// (m) m where the sheet ends.
    pub rim: Vec<[f64; 2]>,
    /// Of a median spot, m.
    pub radius: f64,
}

impl Certificate {
    /// What the table lacks of spots at the most, in the measure of the `sizes` of what they change.
    pub fn error(&self, spots: &[Spot], sizes: &[f64]) -> f64 {
        let each = spots.iter().zip(sizes);
        let square = |(spot, size): (&Spot, &f64)| (self.part(spot) * size).powi(2);
        each.map(square).sum::<f64>().sqrt()
    }

    fn part(&self, spot: &Spot) -> f64 {
        let square = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        let ends = self.rim.iter().map(|end| square(end, &[spot[0], spot[1]]));
        let away = ends.fold(f64::INFINITY, f64::min).sqrt();
        let own = [away / self.radius, spot[2] - self.radius.ln()];
        let far = self.like.iter().map(|like| square(like, &own));
        let mut seen: Vec<_> = far.zip(&self.squares).collect();
        let count = self.neighbours.min(seen.len());
        seen.select_nth_unstable_by(count - 1, |one, other| one.0.total_cmp(&other.0));
        let mean = seen[..count].iter().map(|(_, part)| *part).sum::<f64>() / count as f64;
        self.margin * mean.sqrt().hypot(self.moved)
    }
}
