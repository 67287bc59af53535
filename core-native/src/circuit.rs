//! What a board's amplifiers see of a sheet under each drive.

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
