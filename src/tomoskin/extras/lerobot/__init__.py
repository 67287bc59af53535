"""Sessions as datasets of LeRobot, and touch in the forms in which policies take it."""

from tomoskin.extras.lerobot.dataset import Like as Like, write_lerobot as write_lerobot
from tomoskin.extras.lerobot.policy_forms import (
    FIELDS as FIELDS,
    POSE as POSE,
    SLOTS as SLOTS,
    PolicyForms as PolicyForms,
    PolicyView as PolicyView,
    Slots as Slots,
)
