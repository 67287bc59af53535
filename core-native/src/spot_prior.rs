//! What is likely of a spot before a frame is looked at: where it may be, how large and how strong.

use std::f64::consts::TAU;

use crate::spot_table::{PARAMETERS, Spot};

/// Last column of a spot.
pub const CONTENT: usize = PARAMETERS - 1;

/// Where a spot may be.
#[derive(Debug)]
pub struct Sheet {
    /// Of its cells, m, and how far each reaches from there, m: in order of the first.
    cells: Vec<[f64; 3]>,
}

impl Sheet {
    /// Of cells, one at least: both coordinates of the centroid, m, and how far it reaches, m.
    pub fn of(mut cells: Vec<[f64; 3]>) -> Self {
        cells.sort_by(|one, other| one[0].total_cmp(&other[0]));
        Self { cells }
    }

    /// Brings a spot that is off the sheet back to its nearest cell.
    pub(crate) fn hold(&self, spot: &mut Spot) {
        let (mut nearest, mut least) = (self.cells[0], f64::INFINITY);
        let mut look = |cell: &[f64; 3]| {
            let [along, across] = [cell[0] - spot[0], cell[1] - spot[1]];
            let square = along * along + across * across;
            if square < least {
                (least, nearest) = (square, *cell);
            }
            along * along < least
        };
        // both ways, as far as a nearer one may be
        let ahead = self.cells.partition_point(|cell| cell[0] < spot[0]);
        let _ = self.cells[ahead..].iter().all(&mut look);
        let _ = self.cells[..ahead].iter().rev().all(&mut look);
        let [x, y, margin] = nearest;
        if least.sqrt() > margin {
            [spot[0], spot[1]] = [x, y];
        }
    }
}

/// What is likely of a spot.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Middle of each column; positions have none.
    pub middle: Spot,
    /// One over the deviation of each column; away from its middle counts as much.
    pub weight: Spot,
    /// Of the logarithm of the radius: least and largest.
    pub log_radii: [f64; 2],
    /// Content of a spot of radius and depth one.
    pub filling: f64,
    /// Logarithm of the volume of one spot, and what the content has of that.
    pub log_volume: f64,
    /// See there.
    pub log_content: f64,
    /// Deviations of a spot's direction and of its shape.
    pub directed: f64,
    /// See there.
    pub reshaped: f64,
}

impl Prior {
    /// Deviations from the middle.
    pub(crate) fn away(&self, spot: &Spot) -> Spot {
        [
            0.0,
            0.0,
            (spot[2] - self.middle[2]) * self.weight[2],
            (spot[3] - self.middle[3]) * self.weight[3],
        ]
    }

    pub(crate) fn hold(&self, spot: &mut Spot, depths: [f64; 2]) {
        spot[2] = spot[2].clamp(self.log_radii[0], self.log_radii[1]);
        let filling = self.filling * (2.0 * spot[2]).exp();
        let [low, high] = depths.map(|depth| depth * filling);
        spot[3] = spot[3].clamp(low, high);
    }
}

/// A touch of the frame before where it may have gone, normally distributed.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The most likely; the content is not expected to be anything.
    pub middle: Spot,
    /// Inverse of the covariance of the other columns.
    pub weight: [[f64; CONTENT]; CONTENT],
    /// Logarithm of one over the density at its largest.
    pub volume: f64,
}

impl Expected {
    /// Around `middle` with that covariance of all columns but the content, whose prior takes up
    /// `content` of the volume; `None` where the covariance is not positive.
    pub fn of(middle: Spot, covariance: &[[f64; CONTENT]; CONTENT], content: f64) -> Option<Self> {
        let c = covariance;
        let minor = |i: usize, j: usize| {
            let ([a, b], [p, q]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
            c[a][p] * c[b][q] - c[a][q] * c[b][p]
        };
        let size: f64 = (0..CONTENT).map(|j| c[0][j] * minor(0, j)).sum();
        (size > 0.0).then(|| Self {
            middle,
            weight: std::array::from_fn(|i| std::array::from_fn(|j| minor(j, i) / size)),
            volume: content + (CONTENT as f64 * TAU.ln() + size.ln()) / 2.0,
        })
    }
}
