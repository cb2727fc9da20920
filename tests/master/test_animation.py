"""The animation: its frames are the recorded ones, it plays as long as asked, and it says why it cannot be made."""

from dataclasses import replace
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from commands import printed, refused
from PIL import Image
from runs import SCENES, a_trajectory

from springbeam.pictures import animation
from springbeam.pictures.animation import animate
from springbeam.pictures.drawing import NOT_RESOLVED
from springbeam.pictures.frames import frames_of


def picture_of(run):
    with matplotlib.rc_context(animation.STYLE):
        return animation._Picture(run, frames_of(run))


def test_each_frame_is_a_recorded_one_and_says_if_the_motion_is_not_resolved():
    run = a_trajectory()
    titles = [ax.get_title("right") for ax in picture_of(replace(run, summary={"resolved": False})).figure.axes]
    assert titles == [NOT_RESOLVED, *[""] * (len(titles) - 1)]
    shown, motion = picture_of(run), frames_of(run)
    lowest, highest = run.shapes[1].min(), run.shapes[1].max()
    assert motion.low == motion.foot == pytest.approx(lowest - 0.4 * (highest - lowest))  # room for the coil
    for frame in (0, 123, 399):
        shown.show(frame)
        for line, part, factor in shown._moving:
            assert np.array_equal(line.get_ydata(), factor * motion.heights(part, frame))
        assert np.array_equal(motion.heights("beam", frame), run.shapes[1][frame])
        assert motion.heights("coil", frame)[[0, -1]] == pytest.approx([motion.foot, run.y[frame]])
        assert motion.at(run.time[frame]) == frame
        assert shown._cursor.get_xdata() == [run.time[frame]] * 2
        assert shown._words.get_text().split() == ["t", "=", f"{run.time[frame]:.4f}", "s", str(run.phase[frame])]


@pytest.mark.parametrize("scene", [SCENES["all"], SCENES["spring"]], ids=["all", "spring"])
def test_a_gif_plays_as_long_as_asked(tmp_path, recwarn, scene):
    path = tmp_path / "run.gif"
    animate(a_trajectory(scene), path, seconds=0.5, fps=10)
    with Image.open(path) as gif:
        assert gif.size == (800, 500)
        assert gif.n_frames == 5
        durations, images = [], []
        for frame in range(gif.n_frames):
            gif.seek(frame)
            durations.append(gif.info["duration"])
            images.append(np.asarray(gif.convert("RGB"), dtype=float))
    assert sum(durations) == 500
    assert all(np.any(a != b) for a, b in pairwise(images))
    assert [str(warning.message) for warning in recwarn] == []


# -- the command --------------------------------------------------------------------------------------------------


def test_the_command_writes_a_gif_into_the_directory_and_says_where(tmp_path):
    directory = a_trajectory(n=30).save(tmp_path / "run")
    assert printed("animate", directory, "--seconds", 0.2, "--fps", 10) == f"{directory / 'animation.gif'}\n"
    with Image.open(directory / "animation.gif") as gif:
        assert gif.n_frames == 2
    assert "already exists; --force replaces it" in refused("animate", directory, "--seconds", 0.2)
    assert "nothing to animate" in refused("animate", a_trajectory(n=1).save(tmp_path / "short"))
