import json
import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from gripwright.cad.export import step_bytes, stl_bytes
from gripwright.cli.design import write_folder
from gripwright.cli.options import options_of, owned_setting
from gripwright.design.plan import plan_of, without_effect
from gripwright.domain.errors import InvalidInput, InvalidPlan
from gripwright.geometry.brep import box, write_brep
from mesh_factory import box_mesh

FILES = {"design.json": b"{}", "grippers/G1/finger.stl": b"solid"}


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "gripwright.cli", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize(
    ("text", "option"),
    [
        ("margin=0.2", {"margin": 0.2}),
        ("segmenter=sdf", {"segmenter": "sdf"}),
        ("fitters=cylinder,box", {"fitters": ["cylinder", "box"]}),
        ('fitters=["box"]', {"fitters": ["box"]}),
        ("fitters=box", {"fitters": ["box"]}),
        ("actuators=paper", {"actuators": "paper"}),
        ("actuators=SMC/MHSL3-32D (as in paper),SMC/MHF2-12D2", {"actuators": ["SMC/MHSL3-32D (as in paper)", "SMC/MHF2-12D2"]}),
        ("sdf.rays=20", {"sdf.rays": 20}),
        ("sdf.name=a=b", {"sdf.name": "a=b"}),
    ],
)
def test_values_are_json_where_they_can_be_and_text_or_lists_else(text, option):
    assert options_of([text]) == option


def test_what_is_no_pair_is_refused_together():
    with pytest.raises(InvalidPlan) as refused:
        options_of(["margin", "seed=1", "rays"])

    assert len(refused.value.faults) == 2


def test_a_text_in_place_of_a_list_is_told_in_words_of_json():
    with pytest.raises(InvalidPlan) as refused:
        plan_of({"fitters": "cylinder"})

    (fault,) = refused.value.faults
    assert (fault.pointer, fault.message) == ("/options/fitters", "a list is expected")


def test_a_design_folder_replaces_an_earlier_one_and_leaves_nothing_beside_it(tmp_path):
    write_folder(tmp_path / "out", {**FILES, "old.txt": b""})

    write_folder(tmp_path / "out", FILES)

    found = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert found == {"out/design.json", "out/grippers/G1/finger.stl"}


def test_a_design_folder_is_written_whole_or_not_at_all(tmp_path):
    with pytest.raises(TypeError):
        write_folder(tmp_path / "out", {**FILES, "broken": None})

    assert not list(tmp_path.iterdir())


def test_help_answers_without_importing_the_calculation():
    start = time.process_time()
    code = "import sys; import gripwright.cli; print([m for m in ('numpy', 'fastapi', 'dbos', 'trimesh') if m in sys.modules])"

    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert answer.stdout.strip() == "[]"
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("arguments", "lines"),
    [
        (["design", "no-such-package", "--out", "out"], 1),
        (["design", "no-such-package", "--out", "out", "--set", "margin", "--set", "seed"], 1),
        (["minimise", "no-such-file.json"], 1),
        (["analyse", "no-such-mesh.stl", "--units", "mm"], 1),
        (["analyse", "mesh.doc"], 1),
    ],
)
def test_refused_input_is_exit_code_1_and_a_line_a_fault(tmp_path, arguments, lines):
    answer = run(*arguments, GRIPWRIGHT_DATA=str(tmp_path))

    assert answer.returncode == 1
    assert len(answer.stderr.splitlines()) == lines
    assert ": " in answer.stderr


def test_a_step_file_is_segmented_by_its_own_faces(tmp_path):
    (tmp_path / "block.step").write_bytes(step_bytes(write_brep(box((0, 0, 0), (30, 20, 10))), name="block", part_number="B"))
    labels = tmp_path / "labels.txt"

    answer = run("analyse", tmp_path / "block.step", "--set", "segmenter=brep", "--labels", labels, GRIPWRIGHT_DATA=str(tmp_path))

    assert answer.returncode == 0, answer.stderr
    assert labels.read_text() == "0\n" * 12


def test_a_parameter_that_nothing_reads_is_warned_of(tmp_path):
    (tmp_path / "box.stl").write_bytes(stl_bytes(box_mesh((20.0, 10.0, 5.0))))

    settings = ("--set", "cone.half_angle_min=1", "--set", "sdf.rays=20")
    analysed = run("analyse", str(tmp_path / "box.stl"), "--units", "mm", *settings, GRIPWRIGHT_DATA=str(tmp_path / "data"))

    assert analysed.returncode == 0, analysed.stderr
    warned = [line for line in analysed.stderr.splitlines() if line.startswith("warning: ")]
    assert warned == ["warning: cone.half_angle_min has no effect: the plan does not ask 'cone'"]


def test_parameters_have_an_effect_where_a_plugin_of_any_kind_with_that_key_is_asked():
    plan = plan_of({"ball.rms_max": 0.1, "slot": {"depth": 1, "width": 2}, "box.filled_min": 0.2})

    assert without_effect(plan, ["fitter/box", "rule/ball"]) == [
        "slot.depth has no effect: the plan does not ask 'slot'",
        "slot.width has no effect: the plan does not ask 'slot'",
    ]


def test_triangles_alone_have_no_faces_to_be_segmented_by(tmp_path):
    (tmp_path / "block.stl").write_bytes(stl_bytes(box_mesh((30.0, 20.0, 10.0))))

    answer = run("analyse", tmp_path / "block.stl", "--units", "mm", "--set", "segmenter=brep", GRIPWRIGHT_DATA=str(tmp_path))

    assert answer.returncode == 1
    assert "its file has triangles alone" in answer.stderr
    assert "segmenter=sdf" in answer.stderr


def test_the_better_of_two_segmentations_is_kept_and_both_figures_are_told(tmp_path):
    (tmp_path / "block.stl").write_bytes(stl_bytes(box_mesh((30.0, 20.0, 10.0))))
    shape = tmp_path / "shape.json"

    answer = run(
        "analyse",
        tmp_path / "block.stl",
        "--units",
        "mm",
        "--set",
        "segmenter=best",
        "--json",
        shape,
        GRIPWRIGHT_DATA=str(tmp_path),
    )

    assert answer.returncode == 0, answer.stderr
    remark = "sdf kept: its primitives explain 100.0 % of the surface, those of primitives 100.0 % (a tie: the first is kept)"
    assert remark in answer.stdout.replace("\n", " ")
    assert json.loads(shape.read_text())["remarks"] == [remark]


def test_a_folder_that_is_no_design_is_not_overwritten(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")

    answer = run("design", "no-such-package", "--out", str(tmp_path / "out"), GRIPWRIGHT_DATA=str(tmp_path))

    assert answer.returncode == 1
    assert "--out" in answer.stderr
    assert (tmp_path / "out" / "thesis.tex").exists()


def test_constraints_with_faults_name_each_place(tmp_path):
    document = {"strokes": {"parallel-2": -1}, "components": [{"id": "", "alternatives": []}]}
    (tmp_path / "c.json").write_text(json.dumps(document))

    answer = run("minimise", str(tmp_path / "c.json"))

    assert answer.returncode == 1
    assert {line.split(":")[0] for line in answer.stderr.splitlines()} == {"/strokes/parallel-2", "/components/0/id"}


def test_sigterm_ends_a_command_and_its_children(tmp_path):
    (tmp_path / "mesh.stl").write_text("solid x\nendsolid x\n")
    command = [sys.executable, "-m", "gripwright.cli", "analyse", str(tmp_path / "mesh.stl"), "--units", "mm"]
    process = subprocess.Popen(command, env={**os.environ, "GRIPWRIGHT_DATA": str(tmp_path)}, stdout=subprocess.PIPE)
    process.stdout.readline()  # the first progress: from now on it has children
    children = psutil.Process(process.pid).children(recursive=True)

    process.send_signal(signal.SIGTERM)

    assert process.wait(timeout=30) in (1, 130)
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive


def test_grippers_at_hand_are_read_from_a_list_or_from_an_earlier_design(tmp_path):
    gripper = {"gripper_type": "centric-3", "grip": "external", "opening_min": 1.0, "opening_max": 2.0, "finger_length": 30.0}
    listed, earlier = tmp_path / "owned.json", tmp_path / "design.json"
    listed.write_text(json.dumps([{"name": "old", **gripper}]))
    made = {"id": "G1", "owned": None, **gripper, "palm_radius": 25.0, "actuator": {"maker": "M", "model": "a"}}
    earlier.write_text(json.dumps({"product": {"part_number": "P", "revision": "A"}, "grippers": [made]}))

    assert options_of(owned_setting(listed)) == {"owned": [{"name": "old", **gripper}]}
    assert options_of(owned_setting(earlier)) == {
        "owned": [{"name": "P-A-G1", **gripper, "actuator": "M/a", "palm_radius": 25.0}]
    }


@pytest.mark.parametrize("content", ["{", "3", '{"grippers": [1]}', '{"status": "complete"}'])
def test_a_file_that_names_no_grippers_is_refused(tmp_path, content):
    file = tmp_path / "owned.json"
    file.write_text(content)

    with pytest.raises((InvalidInput, InvalidPlan)):
        plan_of(options_of(owned_setting(file)))
