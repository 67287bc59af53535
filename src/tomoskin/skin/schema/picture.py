"""The skin file: mesh, picture, reference and touches, and the twin."""

from __future__ import annotations

from tomoskin.skin.kinds import Choice, Number, NumberOrWord, Quantity, Whole
from tomoskin.skin.schema.entry import Key, Section

_ONE_STEP = ("method", ("one-step",))

PICTURE: tuple[Section, ...] = (
    Section(
        "mesh",
        "The triangles that the picture is made of.",
        (Key("cells", Whole(50, 100_000), "Wanted number, met within 10 %.", default=1500),),
    ),
    Section(
        "inverse",
        "How voltages become a picture.",
        (
            Key(
                "method",
                Choice(("one-step", "greit")),
                "one-step: the most likely picture under a prior. greit: an operator trained to "
                "show small targets as a stated response; truer places, not sharper.",
                default="one-step",
            ),
            Key(
                "prior",
                Choice(("identity", "laplace", "gaussian", "noser", "exponential", "matern")),
                "What is held to be likely.",
                default="noser",
                when=_ONE_STEP,
            ),
            Key(
                "exponent",
                Number(0, 2),
                "With noser: the power of a cell's sensitivity that weighs it down.",
                default=0.5,
                when=_ONE_STEP,
            ),
            Key(
                "correlation_length",
                Quantity("length", "mm", 0.1, 5000),
                "With exponential and matern: how far a change is alike; without it a tenth of "
                "the sheet's extent.",
                when=_ONE_STEP,
            ),
            Key(
                "alpha",
                NumberOrWord(Number(1e-9, 1e9), Choice(("auto",))),
                "Weight of the prior; it enters squared. auto: chosen by the noise, for a light "
                "touch.",
                default="auto",
                when=_ONE_STEP,
            ),
            Key(
                "noise_figure",
                Number(0.1, 100),
                "How much noisier the picture may be than the voltages, signal for signal.",
                default=1.0,
                when=("method", ("greit",)),
            ),
            Key(
                "difference",
                Choice(("plain", "normalised")),
                "v − v_ref, or (v − v_ref)/|v_ref|.",
                default="plain",
            ),
            Key(
                "time_constant",
                Quantity("time", "s", 0, 3600),
                "How long a picture lasts: each rests on the frames before it too, the more the "
                "longer this is (Kalman filter). 0 s: on its own frame alone.",
                default="0 s",
                when=_ONE_STEP,
            ),
        ),
    ),
    Section(
        "signal",
        "What becomes of the reference while time goes by.",
        (
            Key(
                "baseline",
                Choice(("follow", "hold")),
                "follow: the reference follows the skin's drift while nothing touches, and holds "
                "under a touch. hold: it stays as it was taken.",
                default="follow",
            ),
            Key(
                "common_modes",
                Choice(("projected", "kept")),
                "projected: a change of all voltages in proportion, as temperature makes it, and "
                "directions of drift learnt while idle do not show in the picture. kept: they do.",
                default="projected",
            ),
        ),
    ),
    Section(
        "touch",
        "How data become touches.",
        (
            Key(
                "method",
                Choice(("image", "fit")),
                "image: regions of the picture, by gamma1 to position. fit: place, size and "
                "strength of up to five touches, fitted to the voltages; truer, with honest "
                "deviations.",
                default="image",
            ),
            Key(
                "gamma1",
                Number(0.1, 0.99),
                "First threshold, as a part of the extreme value; 0.6 to 0.7 is usual.",
                default=0.65,
            ),
            Key(
                "gamma2",
                Number(0.1, 1),
                "Second threshold, after smoothing, as a part of the first.",
                default=0.9,
            ),
            Key(
                "smoothing",
                Quantity("length", "mm", 0, 1000),
                "Standard deviation of the Gaussian between the two thresholds.",
                default="5 mm",
            ),
            Key(
                "sign",
                Choice(("decrease", "increase", "both")),
                "Change of conductivity that counts as a touch.",
                default="decrease",
            ),
            Key(
                "snr",
                Number(0, 1000),
                "Extreme value that a touch needs, in standard deviations of the noise.",
                default=5,
            ),
            Key(
                "position",
                Choice(("centroid", "peak")),
                "One touch a region, at its weighted centroid; or one at each local extreme.",
                default="centroid",
            ),
            Key("max_touches", Whole(1, 50), "Most touches reported at once.", default=8),
        ),
    ),
    Section(
        "twin",
        "The simulated skin that stands in for this one; a real skin does not read it.",
        (
            Key(
                "preset",
                Choice(("ideal", "textile", "hydrogel", "tank")),
                "Material and board: without vices and memory, or as measured or assumed.",
                default="ideal",
            ),
        ),
    ),
)
"""What the host makes of the voltages; a page may change most of it while it runs."""
