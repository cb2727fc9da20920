"""The animation: its frames are the recorded ones, it plays as long as asked, and it says why it cannot be made."""

from itertools import pairwise

import numpy as np
from PIL import Image
from runs import a_trajectory

from springbeam.pictures.animation import animate


def test_a_gif_plays_as_long_as_asked(tmp_path, recwarn):
    path = tmp_path / "run.gif"
    animate(a_trajectory(), path, seconds=0.4, fps=10)
    durations = []
    images = []
    with Image.open(path) as gif:
        assert gif.size == (800, 500)
        for frame in range(gif.n_frames):
            gif.seek(frame)
            durations.append(gif.info["duration"])
            images.append(np.asarray(gif.convert("RGB"), dtype=float))
    assert durations == [100] * 4
    assert all(np.any(a != b) for a, b in pairwise(images))
    assert [str(warning.message) for warning in recwarn] == []
