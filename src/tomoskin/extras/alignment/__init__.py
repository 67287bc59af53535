"""Touch learnt, or aligned to another session, from touches at positions that are not known."""

from tomoskin.extras.alignment.rubbing import (
    Rubbing as Rubbing,
    quiet_electrodes as quiet_electrodes,
)
from tomoskin.extras.alignment.session_alignment import (
    SessionAlignment as SessionAlignment,
    in_session as in_session,
)
