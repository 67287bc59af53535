//! What one spot does to the voltages, from a table of splines.

use pulp::{Arch, Simd, WithSimd};

/// Columns of a spot: x, y, logarithm of the radius, content.
pub const PARAMETERS: usize = 4;
/// Directions beside them.
pub const DIRECTIONS: usize = 2;
/// Rows of an expansion: the change and its derivatives.
pub const SLOPES: usize = 1 + PARAMETERS;
/// And its directions.
pub const ROWS: usize = SLOPES + DIRECTIONS;

/// A spot.
pub type Spot = [f64; PARAMETERS];

/// Points of each axis, and radii, that a spot is between.
const NEAR: usize = 4;
/// The change, and its slopes by x, y and the logarithm of the radius.
const MIXED: usize = 4;

/// Positions of one radius.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// The first point, m.
    pub origin: [f64; 2],
    /// Between points, m.
    pub step: f64,
    /// Points along x and y.
    pub shape: [usize; 2],
    /// Number of its first point among those of all grids.
    pub start: usize,
}

/// What the entries of a table are.
#[derive(Debug)]
pub struct Layout {
    /// Logarithms of the radii in m, evenly apart.
    pub log_radii: Vec<f64>,
    /// One of each radius.
    pub grids: Vec<Grid>,
    /// Of exp(depth/4) − 1.
    pub nodes: Vec<f64>,
    /// Entries of the basis.
    pub rank: usize,
    /// Content of a spot of radius and depth one.
    pub filling: f64,
}

/// Spline coefficients of all grids.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// See there.
    pub layout: &'a Layout,
    /// By points, nodes and directions, and entries of the basis.
    pub values: &'a [f32],
}

/// Weights of four points, and the slopes of these.
type Weights = [[f64; NEAR]; 2];

impl Layout {
    /// Checks that the parts fit together, and so many values.
    ///
    /// # Errors
    /// When they do not.
    pub fn checked(self, values: usize) -> Result<Self, &'static str> {
        let points: usize = self.grids.iter().map(|g| g.shape[0] * g.shape[1]).sum();
        let planes = self.nodes.len() + DIRECTIONS;
        if self.log_radii.len() < NEAR || self.grids.len() != self.log_radii.len() {
            return Err("a grid for each of four radii at least");
        }
        if self.grids.iter().any(|g| g.shape.iter().any(|&n| n < NEAR)) {
            return Err("four points along each axis at least");
        }
        if values != points * planes * self.rank || self.nodes.is_empty() {
            return Err("as many values as points, nodes and entries");
        }
        Ok(self)
    }
}

impl Table<'_> {
    /// Writes the expansion of a spot, (rows, rank), to `out`: `rows` are ROWS, or SLOPES where its
    /// directions are not needed.
    pub fn expand(&self, spot: &Spot, rows: usize, out: &mut [f64]) {
        let n = self.layout.nodes.len();
        let planes = n + rows - SLOPES;
        let (width, used) = (
            (n + DIRECTIONS) * self.layout.rank,
            planes * self.layout.rank,
        );
        let mut mixed = vec![0.0; MIXED * used];
        let step = self.layout.log_radii[1] - self.layout.log_radii[0];
        let place = (spot[2] - self.layout.log_radii[0]) / step;
        let most = (self.layout.log_radii.len() - NEAR) as f64;
        let first = (place.floor() - 1.0).clamp(0.0, most);
        let [radius, wider] = cubic(place - first);
        let mut lines = [Line::default(); NEAR * NEAR];
        for level in 0..NEAR {
            let grid = &self.layout.grids[first as usize + level];
            let (x, along) = grid.along(0, spot[0]);
            let (y, across) = grid.along(1, spot[1]);
            for (i, (&weight, &slope)) in along[0].iter().zip(&along[1]).enumerate() {
                lines[level * NEAR + i] = Line {
                    first: (grid.start + (x + i) * grid.shape[1] + y) * width,
                    across,
                    along: [
                        radius[level] * weight,
                        radius[level] * slope,
                        wider[level] / step * weight,
                    ],
                };
            }
        }
        Arch::new().dispatch(Mix {
            values: self.values,
            width,
            lines: &lines,
            mixed: &mut mixed,
        });
        self.of_depth(spot, planes, &mixed, out);
    }

    /// From values and slopes at the nodes to those of the spot's depth.
    fn of_depth(&self, spot: &Spot, planes: usize, mixed: &[f64], out: &mut [f64]) {
        let (n, rank) = (self.layout.nodes.len(), self.layout.rank);
        let filling = self.layout.filling * (2.0 * spot[2]).exp();
        let depth = spot[3] / filling;
        let s = (depth / 4.0).exp_m1();
        let plane = |row: usize, node: usize| &mixed[(row * planes + node) * rank..];
        out.fill(0.0);
        for node in 0..n {
            let (power, slope) = self.power(s, node);
            let steeper = slope * (s + 1.0) / 4.0;
            for row in 0..MIXED {
                let target = &mut out[row * rank..(row + 1) * rank];
                add(target, power, plane(row, node));
            }
            let wider = &mut out[3 * rank..4 * rank];
            add(wider, -2.0 * depth * steeper, plane(0, node));
            let more = &mut out[4 * rank..5 * rank];
            add(more, steeper / filling, plane(0, node));
        }
        for direction in 0..planes - n {
            let first = (SLOPES + direction) * rank;
            add(
                &mut out[first..first + rank],
                depth,
                plane(0, n + direction),
            );
        }
    }

    /// Weight of a node's value at s, and its slope by s.
    fn power(&self, s: f64, node: usize) -> (f64, f64) {
        let others = || (0..self.layout.nodes.len()).filter(move |&other| other != node);
        let apart: f64 = others()
            .map(|other| self.layout.nodes[node] - self.layout.nodes[other])
            .product();
        let product: f64 = others().map(|other| s - self.layout.nodes[other]).product();
        let slope: f64 = others()
            .map(|left_out| {
                let rest = others().filter(|&other| other != left_out);
                rest.map(|other| s - self.layout.nodes[other])
                    .product::<f64>()
            })
            .sum();
        (s * product / apart, (product + s * slope) / apart)
    }
}

impl Grid {
    /// The first of four points along an axis, their weights at a place, and the slopes, 1/m.
    fn along(&self, axis: usize, place: f64) -> (usize, Weights) {
        let far = (place - self.origin[axis]) / self.step;
        let first = far.floor().clamp(1.0, (self.shape[axis] - 3) as f64);
        let [weight, slope] = spline(far - first);
        (first as usize - 1, [weight, slope.map(|s| s / self.step)])
    }
}

/// Cubic B-splines at t after the second of four points, and their slopes.
fn spline(t: f64) -> Weights {
    let u = 1.0 - t;
    let (t2, u2) = (t * t, u * u);
    [
        [
            u2 * u / 6.0,
            (3.0 * t2 * t - 6.0 * t2 + 4.0) / 6.0,
            (3.0 * u2 * u - 6.0 * u2 + 4.0) / 6.0,
            t2 * t / 6.0,
        ],
        [
            -u2 / 2.0,
            (3.0 * t2 - 4.0 * t) / 2.0,
            (4.0 * u - 3.0 * u2) / 2.0,
            t2 / 2.0,
        ],
    ]
}

/// Weights of a cubic through four points, t after the first, and their slopes.
fn cubic(t: f64) -> Weights {
    let far = [t, t - 1.0, t - 2.0, t - 3.0];
    let mut out = [[0.0; NEAR]; 2];
    for (node, apart) in [-6.0, 2.0, -2.0, 6.0].into_iter().enumerate() {
        let [a, b, c] = match node {
            0 => [far[1], far[2], far[3]],
            1 => [far[0], far[2], far[3]],
            2 => [far[0], far[1], far[3]],
            _ => [far[0], far[1], far[2]],
        };
        out[0][node] = a * b * c / apart;
        out[1][node] = (a * b + a * c + b * c) / apart;
    }
    out
}

#[inline(always)]
fn add(target: &mut [f64], scale: f64, values: &[f64]) {
    for (sum, value) in target.iter_mut().zip(values) {
        *sum += scale * value;
    }
}

/// Four points of a line across, and what they count for.
#[derive(Clone, Copy, Default)]
struct Line {
    /// Where the first one is.
    first: usize,
    across: Weights,
    /// Weight of the line, and the slopes of that by x and by the logarithm of the radius.
    along: [f64; 3],
}

/// Sums over the points of all lines: the change, and its slopes by x, y and the logarithm of the
/// radius, one after the other.
struct Mix<'a> {
    values: &'a [f32],
    /// From one point to the next.
    width: usize,
    lines: &'a [Line; NEAR * NEAR],
    mixed: &'a mut [f64],
}

/// Entries that are summed at a time, so that the sums stay in registers.
const ABREAST: usize = 8;

impl WithSimd for Mix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let used = self.mixed.len() / MIXED;
        let whole = used - used % ABREAST;
        for first in (0..whole).step_by(ABREAST) {
            self.lines_at::<S, ABREAST>(first)
                .into_iter()
                .enumerate()
                .for_each(|(row, sums)| {
                    self.mixed[row * used + first..][..ABREAST].copy_from_slice(&sums);
                });
        }
        for first in whole..used {
            self.lines_at::<S, 1>(first)
                .into_iter()
                .enumerate()
                .for_each(|(row, sums)| {
                    self.mixed[row * used + first] = sums[0];
                });
        }
    }
}

impl Mix<'_> {
    /// The sums of so many entries.
    #[inline(always)]
    fn lines_at<S: Simd, const N: usize>(&self, first: usize) -> [[f64; N]; MIXED] {
        let mut out = [[0.0; N]; MIXED];
        for line in self.lines {
            let (mut sum, mut slope) = ([0.0; N], [0.0; N]);
            let [weights, slopes] = &line.across;
            for point in 0..NEAR {
                let values = &self.values[line.first + point * self.width + first..][..N];
                for n in 0..N {
                    let value = f64::from(values[n]);
                    sum[n] = fused::<S>(weights[point], value, sum[n]);
                    slope[n] = fused::<S>(slopes[point], value, slope[n]);
                }
            }
            let [here, by_x, by_radius] = line.along;
            for n in 0..N {
                out[0][n] = fused::<S>(here, sum[n], out[0][n]);
                out[1][n] = fused::<S>(by_x, sum[n], out[1][n]);
                out[2][n] = fused::<S>(here, slope[n], out[2][n]);
                out[3][n] = fused::<S>(by_radius, sum[n], out[3][n]);
            }
        }
        out
    }
}

/// a · b + c, at once where there is an instruction for that.
#[inline(always)]
fn fused<S: Simd>(a: f64, b: f64, c: f64) -> f64 {
    if S::IS_SCALAR {
        a * b + c
    } else {
        a.mul_add(b, c)
    }
}
