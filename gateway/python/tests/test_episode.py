"""Episodes in this process and on a server, by the same calls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import tandem


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tandem.Server]:
    with tandem.serve(runs=tmp_path_factory.mktemp("runs")) as server:
        yield server


def told(briefing: tandem.Briefing) -> tuple[object, ...]:
    """The reply to a start, without the policy's clock, which runs."""
    return briefing.instructions, briefing.robots, briefing.kinds, briefing.brief, briefing.status.state_hash


def play(episode: tandem.BaseEpisode) -> tandem.ResultReply:
    """Every kind of call, and some that are refused."""
    state = episode.get_robot_state("A")
    x, y, z = state.right_wrist.position_m
    episode.move_wrists(20, [tandem.WristMove("A", right_position_m=np.array([x + 0.05, y, z + 0.05]))])
    episode.walk(10, [tandem.WalkMove("B", 0.2, 0.0, 0.0)])
    reach = episode.check_reach("B", left_position_m=[0.3, 0.2, 0.1])
    assert reach.left is not None
    depth = episode.query_depth("A", pixels=[[160, 120], [170, 120]])
    assert len(depth.points) == 2
    rows = np.zeros((2, 3, 35), np.float32)
    rows[..., -1] = 0.74
    stepped = episode.step(rows)
    assert (stepped.executed_steps, stepped.ended) == (3, False)
    with pytest.raises(tandem.Refused) as refused:
        episode.get_robot_state("Q")
    assert refused.value.kind == "unknown-robot"
    episode.wait(5)
    return episode.finish()


def test_the_same_calls_end_in_the_same_state(server: tandem.Server) -> None:
    with tandem.Episode("handover", 2003) as here, tandem.Client(server.url).episode("handover", 2003) as there:
        assert told(here.briefing) == told(there.briefing)
        one, other = play(here), play(there)
    assert one.state_hash == other.state_hash
    assert (one.env_steps, one.tool_calls) == (other.env_steps, other.tool_calls)
    with tandem.Episode("handover", 2004) as another:
        assert play(another).state_hash != one.state_hash


def test_what_is_seen_is_the_same(server: tandem.Server) -> None:
    here = tandem.Episode("pouring", 2001, protocol="benchmark")
    there = tandem.Client(server.url).episode("pouring", 2001, protocol="benchmark")
    with here, there:
        one, other = here.observe(depth=True), there.observe(depth=True)
        assert (one.states, one.cameras) == (other.states, other.cameras)
        assert one.rgb.keys() == one.depth_m.keys() == set(here.robots)
        for robot, image in one.rgb.items():
            assert image.shape == (240, 320, 3)
            assert image.dtype == np.uint8
            assert image.std() > 10
            assert np.array_equal(image, other.rgb[robot])
            assert np.allclose(one.depth_m[robot], other.depth_m[robot], rtol=1e-3)
        assert here.state_columns == there.state_columns
        assert here.state().shape == (2, len(here.state_columns))
        assert np.allclose(here.state(), there.state(), atol=6e-5)


def test_a_real_camera_tells_its_lens_and_is_named() -> None:
    episodes = [tandem.Episode("handover", 2000, renderer="cpu", camera=camera) for camera in ("ideal", "d435i")]
    with episodes[0] as ideal, episodes[1] as real:
        expected, seen = ideal.observe(), real.observe()
        assert expected.cameras[0].distortion is None
        lens = seen.cameras[0].distortion
        assert lens is not None and lens.model == "brown_conrady" and len(lens.coefficients) == 5
        assert not np.array_equal(expected.rgb["A"], seen.rgb["A"])
        assert "camera: d435i" in real.finish().departures
        assert ideal.state_hash == real.state_hash


def test_a_state_has_the_numbers_of_its_columns() -> None:
    with tandem.Episode("handover", 2000) as episode:
        episode.wait(3)
        told = episode.get_robot_state("B")
        state = dict(zip(episode.state_columns, episode.state()[1].tolist(), strict=True))
    assert told.joint_positions_rad is not None
    assert all(math.isclose(state[f"{joint}_rad"], rad, abs_tol=6e-5) for joint, rad in told.joint_positions_rad.items())
    assert told.pelvis_in_start is not None and told.base_command is not None
    assert math.isclose(state["pelvis_in_start_z_m"], told.pelvis_in_start.position_m[2], abs_tol=2e-6)
    assert state["pelvis_height_m"] == pytest.approx(told.base_command.pelvis_height_m)
    assert state["fallen"] == 0.0


def test_paper_tells_less() -> None:
    with tandem.Episode("handover", 2000, assistance="paper") as episode:
        columns = episode.state_columns
        assert episode.state().shape == (2, len(columns))
        assert not any(name.endswith(("_n_m", "_rad_s")) and "joint" in name for name in columns)
        assert "fallen" not in columns
        assert episode.get_robot_state("A").joint_torques_n_m is None
        assert episode.step(np.tile(np.r_[np.zeros(34), 0.74], (2, 1))).fallen == ()
        assert episode.finish().extra_information == ()


def test_the_next_phase_is_explained() -> None:
    with tandem.Episode("handover", seed=2000, assistance="full") as episode:
        assert episode.explain()[0] == "A's right hand does not hold bottle: the right one is off it"
    with tandem.Episode("handover", seed=2000, assistance="paper") as episode, pytest.raises(tandem.TandemError):
        episode.explain()


def test_a_state_that_is_read_is_a_call_recorded_or_not(tmp_path: Path) -> None:
    results: list[tandem.ResultReply] = []
    for record in (None, tmp_path):
        with tandem.Episode("handover", 2000, protocol="benchmark", record=record) as episode:
            episode.state()
            episode.wait(1)
            episode.state()
            results.append(episode.finish())
    one, other = results
    assert one.extra_information == ("joint_velocities", "joint_torques", "hand_forces", "odometry", "gravity")
    assert one.extra_information_replies == other.extra_information_replies
    assert one.tool_calls == other.tool_calls == 6
    assert one.state_hash == other.state_hash
    assert tandem.main(["replay", "--verify", str(tmp_path / "episode.mcap")]) == 0


def test_going_back_goes_the_same_way_again() -> None:
    with tandem.Episode("handover", 2002) as episode:
        episode.wait(10)
        before = episode.state_hash
        snapshot = episode.snapshot()
        episode.walk(15, [tandem.WalkMove("A", 0.3, 0.0, 0.0)])
        after = episode.state_hash
        episode.restore(snapshot)
        assert episode.state_hash == before
        episode.restore(tandem.Snapshot.from_bytes(snapshot.to_bytes()))
        episode.walk(15, [tandem.WalkMove("A", 0.3, 0.0, 0.0)])
        assert episode.state_hash == after
    with tandem.Episode("handover", 2005) as other, pytest.raises(tandem.Refused, match="seed 2002"):
        other.restore(snapshot)


def test_the_end_is_an_exception_and_start_begins_anew() -> None:
    episode = tandem.Episode("handover", 2000)
    with pytest.raises(tandem.TandemError, match="start"):
        episode.wait(1)
    first = told(episode.start())
    result = episode.finish()
    assert result.ended == "finished"
    assert episode.ended == "finished"
    with pytest.raises(tandem.EpisodeEnded):
        episode.wait(1)
    assert episode.close() == episode.close() == result
    with pytest.raises(tandem.EpisodeEnded):
        episode.wait(1)
    assert told(episode.start()) == first
    episode.wait(1)
    episode.close()


def test_refusals_say_what_would_work(server: tandem.Server) -> None:
    with pytest.raises(tandem.Refused, match="have: handover"):
        tandem.Episode("handove").start()
    with pytest.raises(tandem.Refused, match="have: handover"):
        tandem.Client(server.url).episode("handove").start()
    with pytest.raises(tandem.TandemError, match="cpu"):
        tandem.Episode("handover", renderer="paint").start()  # pyright: ignore[reportArgumentType]
    with tandem.Episode("handover", 2000) as here, tandem.Client(server.url).episode("handover", 2000) as there:
        texts: list[str] = []
        for episode in (here, there):
            with pytest.raises(tandem.Refused) as refused:
                episode.wait(10_000)
            texts.append(f"{refused.value.kind}: {refused.value}")
            with pytest.raises(ValueError, match="give 2 robots by 35"):
                episode.step(np.zeros((3, 35)))
            with pytest.raises(ValueError, match="give 2 robots by 35"):
                episode.step(np.zeros((2, 34)))
            with pytest.raises(tandem.Refused):
                episode.step(np.full((2, 35), np.nan))
        assert texts[0] == texts[1]
        assert "25" in texts[0]
    with pytest.raises(tandem.Unreachable, match="gives no answer"):
        tandem.Client("http://127.0.0.1:9").tasks()
    with pytest.raises(tandem.TandemError, match="no address"):
        tandem.Client("127.0.0.1:8700")


def test_rows_are_compared_as_shapes() -> None:
    with tandem.Episode("handover", 2000, protocol="benchmark") as episode:
        for shape in ((2,), (35, 2), (2, 35, 5), (2, 34), (1, 2, 35)):
            with pytest.raises(ValueError, match="rows have the shape"):
                episode.step(np.zeros(shape))
        assert episode.step(np.tile([*np.zeros(34), 0.74], (2, 5, 1))).executed_steps == 5


def test_tasks_are_listed_alike(server: tandem.Server) -> None:
    assert tandem.tasks() == tandem.Client(server.url).tasks()
    suites = [told.suite for told in tandem.tasks().tasks]
    assert suites == [None] * 10 + ["tandem+"] * (len(suites) - 10) and len(suites) > 10


TASK_FILE = Path(__file__).parents[2] / "examples" / "tasks" / "pass_the_parcel.toml"


def test_a_task_of_a_file_is_played_and_verified(tmp_path: Path) -> None:
    with tandem.Episode("pass_the_parcel", task_file=TASK_FILE, protocol="benchmark", record=tmp_path) as episode:
        assert [phase.id for phase in episode.briefing.phases] == ["push", "sweep"]
        assert episode.wait(5).executed_steps == 5
        result = episode.close()
    assert result.task == "pass_the_parcel" and list(result.phases) == ["p1", "p2"]
    recording = next(tmp_path.rglob("episode.mcap"))
    assert tandem.Recording(recording).task == "pass_the_parcel"
    evaluation = tandem.evaluate("idle", "pass_the_parcel", 0, task_file=TASK_FILE, out=tmp_path / "idle")
    assert evaluation.tasks["pass_the_parcel"].episodes == 1
    with pytest.raises(tandem.TandemError, match=r"nothing\.toml"):
        tandem.Episode("pass_the_parcel", task_file="nothing.toml").start()
