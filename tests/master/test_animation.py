"""The animation: its frames are the recorded ones, it plays as long as asked, and it says why it cannot be made."""

from itertools import pairwise

import numpy as np
from commands import printed, refused
from PIL import Image
from runs import SCENES, a_trajectory

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


def test_the_command_writes_a_gif_into_the_directory_and_says_where(tmp_path):
    directory = a_trajectory(SCENES["spring"], n=30).save(tmp_path / "run")
    assert printed("animate", directory, "--seconds", 0.2, "--fps", 10) == f"{directory / 'animation.gif'}\n"
    with Image.open(directory / "animation.gif") as gif:
        assert gif.n_frames == 2
    assert "already exists; --force replaces it" in refused("animate", directory, "--seconds", 0.2)
    assert "nothing to animate" in refused("animate", a_trajectory(n=1).save(tmp_path / "short"))
