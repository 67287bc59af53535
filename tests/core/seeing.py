"""How colours look: OKLab (B. Ottosson 2020), to eyes that lack a kind of cone, and where they are.

The linear model of colour vision deficiency, at its full strength, is that of Machado, Oliveira &
Fernandes 2009, table 1.
"""

import numpy as np

CONES = np.array([
    [0.4122214708, 0.5363325363, 0.0514459929],
    [0.2119034982, 0.6806995451, 0.1073969566],
    [0.0883024619, 0.2817188376, 0.6299787005],
])  # fmt: skip
OPPONENTS = np.array([
    [0.2104542553, 0.7936177850, -0.0040720468],
    [1.9779984951, -2.4285922050, 0.4505937099],
    [0.0259040371, 0.7827717662, -0.8086757660],
])  # fmt: skip
EYES = {
    "all cones": np.eye(3),
    "protanopia": np.array([
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ]),
    "deuteranopia": np.array([
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ]),
    "tritanopia": np.array([
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ]),
}  # fmt: skip


def seen(levels, eye="all cones"):
    """(…, 3) OKLab lightness, a and b of sRGB levels 0…255 (…, 3), to such an eye."""
    encoded = np.asarray(levels) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    shown = np.clip(linear @ EYES[eye].T, 0, 1)
    return np.cbrt(shown @ CONES.T) @ OPPONENTS.T


def blue_beside_red(picture):
    """Whether a picture of one sheet (h, w, 3) is blue at its left and red at its right.

    It has to hold both colours; that its bar of colours does not count.
    """
    levels = np.asarray(picture).astype(int)
    levels = levels[:, : 3 * levels.shape[1] // 4]
    blue = levels[..., 2] - levels[..., 0] > 90
    red = levels[..., 0] - levels[..., 2] > 90
    assert blue.mean() > 0.005
    assert red.mean() > 0.005
    left, right = (np.nonzero(side)[1] for side in (blue, red))
    return np.percentile(left, 90) < np.percentile(right, 10)
