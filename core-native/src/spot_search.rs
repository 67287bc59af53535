//! How many touches a frame holds: one more as long as the evidence for it grows.
//!
//! As `ForwardSelection` in tomoskin/sensing/fit/selection.py, of which it does what needs no exact
//! model. The numbers by which it decides come from tomoskin/sensing/fit/policy.py, by their names.

use std::f64::consts::TAU;

use crate::spot_algebra::{Metric, eliminated};
use crate::spot_fit::{Fit, Frame, Known};
use crate::spot_match::{Limits, Signatures, standing, standing_out};
use crate::spot_table::{PARAMETERS, Spot};

/// How much is tried in a frame; see `Pace` in tomoskin/sensing/fit/policy.py.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "python", derive(pyo3::FromPyObject))]
pub struct Pace {
    /// Steps from the touches of the frame before.
    pub warm: usize,
    /// Steps from each start.
    pub glance: usize,
    /// Further steps from the best ones.
    pub cold: usize,
    /// How many are gone on with.
    pub finalists: usize,
    /// New touches that are tried.
    pub tries: usize,
    /// Part of the ratio at which a touch begins from which a further one is tried.
    pub look: f64,
    /// Logarithm of the odds against a touch's beginning in a frame.
    pub rare: f64,
    /// Whether a frame that changes is looked at from nothing too.
    pub restart: bool,
}

/// What counts as a touch; see `DetectionPolicy` in tomoskin/sensing/fit/policy.py.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "python", derive(pyo3::FromPyObject))]
pub struct Policy {
    /// Likelihood ratio, in deviations, at which a touch begins.
    pub least: f64,
    /// Touches at most.
    pub most: usize,
    /// See there.
    pub pace: Pace,
    /// Part of that at which it stays.
    pub held: f64,
    /// Times the ratio at which one begins from which no frame is explained better without it.
    pub sure: f64,
    /// Part of what touches change that a wrong profile may leave.
    pub misshapen: f64,
    /// Radii within which there is no room for another touch.
    pub within: f64,
    /// Radii within which a touch may stand for what the profile of another one does not say.
    pub near: f64,
}

/// A fit, and whether it was made without what the table lacks.
#[derive(Clone, Debug)]
pub struct Found {
    /// See there.
    pub fit: Fit,
    /// Without the frame's offset.
    pub bare: bool,
    /// Likelihood ratios and contents of candidates beside it, where these have been looked at.
    pub others: Option<[Vec<f64>; 2]>,
    /// One spot more, that was not worth it.
    pub turned_down: Option<Fit>,
}

/// Spots, and who they are.
type Start = (Vec<Spot>, Vec<Known>);

/// A search in one frame.
#[derive(Debug)]
pub struct Search<'a> {
    /// The frame, and the same without its offset.
    pub frames: [Frame<'a>; 2],
    /// Of the directions that residual responses leave.
    pub left: &'a Metric,
    /// Spots of content 1.
    pub candidates: &'a [Spot],
    /// What they show.
    pub signatures: Signatures<'a>,
    /// What counts of candidates.
    pub limits: Limits,
    /// See there.
    pub policy: Policy,
}

impl Search<'_> {
    /// Touches of the frame, from those of the last one; `None` where nothing can be compared.
    pub fn found(&self, before: &[Spot]) -> Option<Found> {
        let expected = self.frames[0].expected.len();
        let known: Vec<Known> = (0..before.len())
            .map(|i| (i < expected).then_some(i))
            .collect();
        let (kept, weakest) = self.pruned(self.started(before, &known)?)?;
        let lost = match kept.fit.spots.len() {
            0 => 0,
            k => before.len() - k,
        };
        let tries = self.policy.pace.tries as isize - lost as isize;
        let (mut found, tried, changed) = self.more(kept, tries)?;
        if tries > tried && tried == 0 {
            found = self.fewer(found, weakest)?;
        }
        let astray = if self.policy.pace.restart {
            found.fit.spots.len() != before.len() || !found.fit.settled
        } else {
            tried > 0 && !changed
        };
        if !before.is_empty() && astray {
            let (fresh, ..) = self.more(self.nothing()?, self.policy.pace.tries as isize)?;
            if self.evidence(&fresh.fit) >= self.evidence(&found.fit) {
                found = fresh;
            }
        }
        Some(found)
    }

    fn nothing(&self) -> Option<Found> {
        self.refined(&[], &[], true, 0)
    }

    fn refined(&self, spots: &[Spot], known: &[Known], bare: bool, steps: usize) -> Option<Found> {
        let fit = self.frames[usize::from(bare)].settled(spots, known, steps)?;
        Some(Found {
            fit,
            bare,
            others: None,
            turned_down: None,
        })
    }

    fn started(&self, before: &[Spot], known: &[Known]) -> Option<Found> {
        if before.is_empty() {
            return self.nothing();
        }
        let most = before.len().min(self.policy.most);
        self.refined(
            &before[..most],
            &known[..most],
            false,
            self.policy.pace.warm,
        )
    }

    fn without(&self, fit: &Fit, number: usize) -> Option<Found> {
        self.started(&without(&fit.spots, number), &without(&fit.known, number))
    }

    /// Without the spots that have faded; and the weakest of the others.
    fn pruned(&self, mut found: Found) -> Option<(Found, (usize, f64))> {
        while !found.fit.spots.is_empty() {
            let (weakest, ratio) = self.weakest(&found.fit)?;
            if ratio >= self.policy.held * self.policy.least {
                return Some((found, (weakest, ratio)));
            }
            found = self.without(&found.fit, weakest)?;
        }
        Some((found, (0, f64::INFINITY)))
    }

    /// Without the weakest of several spots, where that explains the frame as well.
    fn fewer(&self, found: Found, (weakest, ratio): (usize, f64)) -> Option<Found> {
        if found.fit.spots.len() < 2 {
            return Some(found);
        }
        let enough = if found.fit.settled {
            1.0
        } else {
            self.policy.sure
        };
        if ratio >= enough * self.policy.least {
            return Some(found);
        }
        let fewer = self.without(&found.fit, weakest)?;
        let better = self.evidence(&fewer.fit) > self.evidence(&found.fit);
        Some(if better { fewer } else { found })
    }

    /// With further spots, while they are worth it; how many were tried, and whether one was.
    fn more(&self, mut found: Found, tries: isize) -> Option<(Found, isize, bool)> {
        let room = self.policy.most as isize - found.fit.spots.len() as isize;
        let mut changed = false;
        for tried in 0..tries.min(room) {
            let fit = &found.fit;
            let parts: [&[f64]; 3] = [
                &fit.metric.unknown.values,
                &fit.jacobian.values,
                &fit.residual,
            ];
            let [ratios, contents] = standing_out(self.signatures, parts, self.limits)?;
            let (best, ratio) = largest(&ratios)?;
            let content = contents[best];
            let held = self.policy.held;
            let part = if fit.spots.is_empty() {
                held
            } else {
                self.policy.pace.look
            };
            let few = ratio < self.threshold(fit, part);
            found.others = Some([ratios, contents]);
            if few {
                return Some((found, tried, changed));
            }
            let fit = &found.fit;
            let mut fresh = self.candidates[best];
            fresh[3] = content;
            let more = self.best(&starts(fit, fresh), found.bare)?;
            let worth = self.weakest(&more.fit)?.1 >= self.threshold(fit, 1.0);
            let gain = self.evidence(&more.fit) - self.evidence(fit);
            if !worth || gain <= self.policy.pace.rare + self.against(fit, &more.fit) {
                found.turned_down = Some(more.fit);
                return Some((found, tried + 1, changed));
            }
            (found, changed) = (more, true);
        }
        Some((found, tries, changed))
    }

    /// The most evident of those that come out best after a glance.
    fn best(&self, starts: &[Start], bare: bool) -> Option<Found> {
        let glance =
            |(start, known): &Start| self.refined(start, known, bare, self.policy.pace.glance);
        let mut fits: Vec<Found> = starts.iter().map(glance).collect::<Option<_>>()?;
        fits.sort_by(|one, other| one.fit.cost.total_cmp(&other.fit.cost));
        fits.truncate(self.policy.pace.finalists);
        let mut best: Option<(f64, Found)> = None;
        for mut found in fits {
            if !found.fit.settled {
                let Fit { spots, known, .. } = &found.fit;
                found = self.refined(spots, known, bare, self.policy.pace.cold)?;
            }
            let evidence = self.evidence(&found.fit);
            if best.as_ref().is_none_or(|(most, _)| evidence > *most) {
                best = Some((evidence, found));
            }
        }
        best.map(|(_, found)| found)
    }

    /// Number of the spot that stands out least, and by how many deviations.
    fn weakest(&self, fit: &Fit) -> Option<(usize, f64)> {
        let parts = [&fit.jacobian.values[..], &fit.each.values];
        let squares = standing(self.left, parts, self.limits.ridge)?;
        let least = squares.iter().copied().enumerate();
        let (spot, square) = least.min_by(|one, other| one.1.total_cmp(&other.1))?;
        Some((spot, square.sqrt()))
    }

    /// What a wrong profile may leave adds to the noise.
    fn threshold(&self, fit: &Fit, part: f64) -> f64 {
        part * self.policy.least * 1.0_f64.hypot(self.misshapen(fit) / self.policy.least)
    }

    /// Deviations that a wrong profile of the spots of a fit may leave.
    fn misshapen(&self, fit: &Fit) -> f64 {
        let square: f64 = fit.predicted.iter().map(|value| value * value).sum();
        self.policy.misshapen * square.sqrt()
    }

    /// Logarithm of the odds that a wrong profile of what was found may give to a fit with one
    /// spot more: infinite where two are at one place.
    fn against(&self, found: &Fit, more: &Fit) -> f64 {
        let mut least = f64::INFINITY;
        for (i, one) in more.spots.iter().enumerate() {
            for (j, other) in more.spots.iter().enumerate() {
                if i != j {
                    let apart = (one[0] - other[0]).hypot(one[1] - other[1]);
                    least = least.min(apart / one[2].exp());
                }
            }
        }
        if least < self.policy.within {
            f64::INFINITY
        } else if least < self.policy.near {
            self.misshapen(found).powi(2) / 2.0
        } else {
            0.0
        }
    }

    /// Logarithm of the evidence, by Laplace's method.
    fn evidence(&self, fit: &Fit) -> f64 {
        let n = fit.normal.height;
        let mut normal = fit.normal.clone();
        let Some(half_log_det) = eliminated(&mut normal, n) else {
            return f64::NEG_INFINITY;
        };
        let expected = self.frames[0].expected;
        let old = fit.known.iter().flatten();
        let old: f64 = old.map(|&number| expected[number].volume).sum();
        let new = fit.known.iter().filter(|known| known.is_none()).count();
        let orders: f64 = (1..=new).map(|i| (i as f64).ln()).sum();
        let volume = n as f64 * TAU.ln() / 2.0 - half_log_det;
        let prior = orders - new as f64 * self.frames[0].prior.log_volume - old;
        prior + volume - fit.cost - fit.metric.log_size
    }
}

/// The first largest value, and where it is.
fn largest(values: &[f64]) -> Option<(usize, f64)> {
    let first = |best: Option<(usize, f64)>, (i, &value): (usize, &f64)| match best {
        Some((_, most)) if most >= value => best,
        _ => Some((i, value)),
    };
    values.iter().enumerate().fold(None, first)
}

fn without<T: Copy>(all: &[T], number: usize) -> Vec<T> {
    let mut rest = all.to_vec();
    rest.remove(number);
    rest
}

/// The new spot beside the others; or instead of half of the nearest.
fn starts(fit: &Fit, fresh: Spot) -> Vec<Start> {
    debug_assert_eq!(fresh.len(), PARAMETERS);
    let Fit { spots, known, .. } = fit;
    let beside = [&spots[..], &[fresh]].concat();
    let mut starts = vec![(beside, [&known[..], &[None]].concat())];
    let away = |spot: &Spot| [fresh[0] - spot[0], fresh[1] - spot[1]];
    let far = |spot: &Spot| away(spot)[0].hypot(away(spot)[1]);
    let near = (0..spots.len()).min_by(|&i, &j| far(&spots[i]).total_cmp(&far(&spots[j])));
    if let Some(near) = near {
        let half = spots[near];
        let reach = 0.7 * half[2].exp() / far(&half).max(1e-9);
        let [x, y] = away(&half);
        let mut instead = without(spots, near);
        for side in [-reach, reach] {
            let [u, v, log_radius, content] = half;
            instead.push([u + side * x, v + side * y, log_radius - 0.3, content / 2.0]);
        }
        starts.push((instead, [without(known, near), vec![None; 2]].concat()));
    }
    starts
}
