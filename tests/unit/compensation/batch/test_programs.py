"""A batch: which programs there are, what is written where, what is skipped, what an error stops."""

import json
import pickle
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from camcomp import __version__
from camcomp.api.compensation import compensate_file
from camcomp.compensation.batch import programs
from camcomp.compensation.batch.worker import Outcome, Task, work
from camcomp.ground.errors import ConfigError, FileError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.terminal import cli
from tests.commandline import camcomp

MACHINE = str(shipped("config/cartesian.yaml"))
GOOD = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nX{x}\nM30\n"


def tree(folder, **programs):
    for name, text in programs.items():
        path = folder / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def places(paths, out="out"):
    return {each.relative.as_posix() for each in programs.find_programs([str(path) for path in paths], Path(out))}


# --- finding ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def parts(tmp_path):
    for name in ("a.nc", "deep/b.NGC", "deep/c.tap", "deep/notes.md", "out/a.nc", "d.gcode", "r.src", "deep/r.LS"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(GOOD)
    return tmp_path


def test_folders_are_searched_and_mirrored_without_the_outputs(parts):
    assert places([parts], parts / "out") == {"a.nc", "deep/b.NGC", "deep/c.tap", "d.gcode", "r.src", "deep/r.LS"}


def test_patterns_mirror_what_lies_behind_their_fixed_part(parts):
    assert places([parts / "deep" / "*"]) == {"b.NGC", "c.tap", "notes.md", "r.LS"}
    assert places([parts / "**" / "*.tap"]) == {"deep/c.tap"}


def test_a_file_named_twice_counts_once(parts):
    assert places([parts / "a.nc", parts / "a.nc", parts / "a.*"]) == {"a.nc"}


def test_two_programs_for_one_place_are_refused(parts):
    with pytest.raises(FileError, match="would both become") as error:
        places([parts / "a.nc", parts / "out" / "a.nc"], parts / "elsewhere")
    assert error.value.rule == "CC502"


def test_a_link_is_a_program_beside_the_file_that_it_leads_to(parts):
    (parts / "link.nc").symlink_to("a.nc")
    (parts / "gone.nc").symlink_to("nothing.nc")
    assert places([parts], parts / "out") == {
        "a.nc",
        "link.nc",
        "gone.nc",
        "deep/b.NGC",
        "deep/c.tap",
        "d.gcode",
        "r.src",
        "deep/r.LS",
    }
    (parts / "same").symlink_to("deep")
    assert places([parts / "deep", parts / "same"]) == {"b.NGC", "c.tap", "r.LS"}


def test_nothing_found_is_an_error(parts):
    with pytest.raises(ConfigError) as error:
        places([parts / "*.xyz"])
    assert error.value.rule == "CC271"
    with pytest.raises(FileError):
        places([parts / "missing.nc"])


# --- running, with work that is counted -------------------------------------------------------------------------------


@pytest.fixture
def bench(tmp_path):
    """run() = one batch over tmp_path/in: statuses by relative name; .worked = names that were really worked on."""

    class Bench:
        def __init__(self):
            self.folder = tree(tmp_path / "in", **{name: GOOD.format(x=name) for name in ("a.nc", "b.nc", "c.nc")})
            self.worked = []

        def run(self, *, version="1", tolerance=1.0, bad=()):
            self.worked = []

            def pool(tasks):
                for task in tasks:
                    name = Path(task.name).name
                    self.worked.append(name)
                    if name in bad:
                        yield Outcome(
                            key=task.key, exit_code=3, messages=[{"rule": "CC102", "message": "m", "text": "t"}]
                        )
                    else:
                        figures = {"before": {"max_um": 9.0}, "after": {"max_um": 0.5}}
                        yield Outcome(
                            key=task.key,
                            exit_code=0,
                            messages=[],
                            program=b"corrected " + task.data,
                            joints=None,
                            figures=figures,
                        )

            config = load_config([MACHINE])
            plan = programs.Plan(
                config=config,
                output=tmp_path / "out",
                method="newton",
                tolerance_um=tolerance,
                joints=False,
                version=version,
            )
            found = programs.find_programs([str(self.folder)], plan.output)
            return {Path(each.source).name: each for each in programs.run_batch(plan, found, pool)}

    return Bench()


def test_what_is_unchanged_is_skipped_and_what_changed_is_done_again(bench, tmp_path):
    first = bench.run()
    assert {each.status for each in first.values()} == {programs.DONE} and len(bench.worked) == 3
    again = bench.run()
    assert {each.status for each in again.values()} == {programs.SKIPPED} and bench.worked == []
    assert again["a.nc"].figures == first["a.nc"].figures
    (bench.folder / "b.nc").write_text("other")
    bench.run()
    assert bench.worked == ["b.nc"]
    (tmp_path / "out" / "c.nc").write_text("changed by hand")
    bench.run()
    assert bench.worked == ["c.nc"]
    bench.run(version="2")
    assert len(bench.worked) == 3
    bench.run(version="2", tolerance=2.0)
    assert len(bench.worked) == 3


def test_an_error_stops_nothing_and_is_tried_again(bench, tmp_path):
    first = bench.run(bad=("b.nc",))
    assert [first[name].exit_code for name in ("a.nc", "b.nc", "c.nc")] == [0, 3, 0]
    assert first["b.nc"].output is None and not (tmp_path / "out" / "b.nc").exists()
    assert (tmp_path / "out" / "c.nc").read_bytes().startswith(b"corrected")
    total = programs.summary(list(first.values()))
    assert total["exit_code"] == 3 and total["counts"][programs.ERROR] == 1 and total["after"]["max_um"] == 0.5
    bench.run()
    assert bench.worked == ["b.nc"]


def test_changed_configuration_is_noticed_by_its_content(tmp_path):
    machine = tmp_path / "m.yaml"
    machine.write_text(Path(MACHINE).read_text())
    keys = set()
    for stiffness in ("2.0e+4", "3.0e+4"):
        machine.write_text(machine.read_text().replace("2.0e+4", stiffness))
        plan = programs.Plan(
            config=load_config([machine]), output=tmp_path, method="newton", tolerance_um=1.0, joints=False, version="1"
        )
        keys.add(programs.key_of_config(plan))
    assert len(keys) == 2


def test_configuration_on_standard_input_counts_by_its_content(tmp_path, monkeypatch):
    keys = []
    for text in (
        Path(MACHINE).read_text(),
        Path(MACHINE).read_text(),
        Path(MACHINE).read_text().replace("2.0e+4", "3.0e+4"),
    ):
        monkeypatch.setattr("sys.stdin", TextIOWrapper(BytesIO(text.encode())))
        keys.append(
            programs.key_of_config(
                programs.Plan(
                    config=load_config(["-"]),
                    output=tmp_path,
                    method="newton",
                    tolerance_um=1.0,
                    joints=False,
                    version="1",
                )
            )
        )
    assert keys[0] == keys[1] != keys[2]


def test_a_changed_table_is_noticed_wherever_the_configuration_names_it(tmp_path):
    table, machine = tmp_path / "forces.csv", tmp_path / "m.yaml"
    machine.write_text("process: {force: {model: table, file: forces.csv}}\n")
    keys = set()
    for force in (1, 2):
        table.write_text(f"feed_mm_min,fr_N,ft_N,fz_N\n100,{force},0,0\n200,{force},0,0\n")
        config = load_config([MACHINE, machine])
        keys.add(
            programs.key_of_config(
                programs.Plan(
                    config=config, output=tmp_path, method="newton", tolerance_um=1.0, joints=False, version="1"
                )
            )
        )
    assert len(keys) == 2


def test_two_batches_do_not_write_into_one_folder(tmp_path):
    plan = programs.Plan(
        config=load_config([MACHINE]),
        output=tmp_path / "out",
        method="newton",
        tolerance_um=1.0,
        joints=False,
        version="1",
    )
    with programs.output_tree(plan, [], []):
        with pytest.raises(FileError) as error, programs.output_tree(plan, [], []):
            pass
        assert error.value.rule == "CC504" and str(tmp_path / "out") in error.value.message
    with programs.output_tree(plan, [], []):
        pass


def test_outputs_that_are_one_file_through_links_are_refused(bench, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.nc").symlink_to("b.nc")
    plan = programs.Plan(
        config=load_config([MACHINE]),
        output=tmp_path / "out",
        method="newton",
        tolerance_um=1.0,
        joints=False,
        version="1",
    )
    found = programs.find_programs([str(bench.folder)], plan.output)
    with pytest.raises(FileError, match="same file") as error, programs.output_tree(plan, found, []):
        pass
    assert error.value.rule == "CC502"
    with (
        pytest.raises(FileError, match="same file"),
        programs.output_tree(plan, found, [str(tmp_path / "out" / "c.nc")]),
    ):
        pass


# --- one program ------------------------------------------------------------------------------------------------------


def task(text, joints=False):
    plan = programs.Plan(
        config=load_config([MACHINE]),
        output=Path("out"),
        method="newton",
        tolerance_um=1.0,
        joints=joints,
        version=__version__,
    )
    return Task(name="p.nc", key="key", data=text.encode(), plan=pickle.dumps(plan))


def test_a_worker_gives_back_program_table_and_figures():
    done = work(task(GOOD.format(x=9), joints=True))
    assert done.exit_code == 0 and done.messages == []
    assert b"camcomp" in done.program and done.joints.startswith(b"line,s_mm")
    assert done.figures["after"]["max_um"] <= 1.0 < done.figures["before"]["max_um"]


def test_a_worker_corrects_long_programs_in_pieces_as_the_command_does(tmp_path, monkeypatch):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", 1)
    text = GOOD.format(x=9).replace("M30", "".join(f"X{9 - k % 7} Y{k % 5}.25\n" for k in range(200)) + "M30")
    (tmp_path / "p.nc").write_text(text)
    compensate_file(str(tmp_path / "p.nc"), [MACHINE], output=str(tmp_path / "o.nc"), joints=str(tmp_path / "j.csv"))
    done = work(task(text, joints=True))
    assert done.figures["interpolation"]["checked"] > 0
    assert done.program == (tmp_path / "o.nc").read_bytes() and done.joints == (tmp_path / "j.csv").read_bytes()


@pytest.mark.parametrize(
    ("text", "code", "rule"),
    [
        ("G1 X1,5", 3, "CC101"),
        ("G0 X99999 Y0 Z0", 1, "CC602"),
        ("(camcomp 1 sha256:" + "0" * 64 + ")\nG0 X1", 1, "CC603"),
    ],
)
def test_a_worker_turns_errors_into_exit_codes(text, code, rule):
    done = work(task(text))
    assert (done.exit_code, done.messages[0]["rule"]) == (code, rule)


def test_a_bug_in_one_program_is_kept_in_it(monkeypatch):
    monkeypatch.setattr("camcomp.compensation.batch.worker._compensate", lambda task: 1 / 0)
    done = work(task(GOOD))
    assert done.exit_code == 70 and "ZeroDivisionError" in done.messages[0]["message"]


# --- the verb ---------------------------------------------------------------------------------------------------------


def test_the_verb(tmp_path):
    source = tree(tmp_path / "in", **{"one.nc": GOOD.format(x=5), "two.nc": GOOD.format(x=6), "bad.nc": "G1 X1,5"})
    words = ("batch", source, "--config", MACHINE, "--output-dir", tmp_path / "out", "--jobs", 2)
    first = camcomp(*words)
    assert first.returncode == 3, first.stderr.decode()
    assert "decimal comma" in first.stderr.decode() and "3 programs: 2 done, 1 error" in first.stderr.decode()
    alone = camcomp("compensate", source / "one.nc", "--config", MACHINE)
    assert (tmp_path / "out" / "one.nc").read_bytes() == alone.stdout
    figures = json.loads((tmp_path / "out" / "camcomp-batch.json").read_text())
    assert [Path(each["source"]).name for each in figures["files"]] == ["bad.nc", "one.nc", "two.nc"]
    (source / "bad.nc").unlink()
    second = camcomp(*words)
    assert second.returncode == 0 and "2 unchanged" in second.stderr.decode()
    piped = ["-" if word == MACHINE else 1 if word == 2 else word for word in words]
    assert "2 unchanged" in camcomp(*piped, stdin=Path(MACHINE).read_bytes()).stderr.decode()
    softer = Path(MACHINE).read_bytes().replace(b"2.0e+4", b"3.0e+4")
    assert "2 done" in camcomp(*piped, stdin=softer).stderr.decode()


def test_an_empty_address_is_no_scheduler(tmp_path):
    done = cli.run(["batch", MACHINE, "--config", MACHINE, "--output-dir", str(tmp_path), "--scheduler", ""])
    assert done == 2
