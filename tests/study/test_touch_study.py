"""Studies of pressed bodies: text and back, what is refused, and the objects that they mean."""

from __future__ import annotations

import pytest

from palpate.errors import StudyError, UsageError
from palpate.study import Study, preset_names, preset_study, read_study, to_toml

SOLIDS = [name for name in preset_names() if not name.startswith("beam")]
ALL = [(name, quick) for name in SOLIDS for quick in (False, True)]


@pytest.mark.parametrize(("name", "quick"), ALL)
def test_every_preset_reads_back_and_builds_its_body(name, quick, tmp_path):
    study = preset_study(name, quick=quick)
    path = tmp_path / "s.toml"
    path.write_text(to_toml(study), encoding="utf-8")
    assert read_study(path) == study
    assert study.name == name + ("-quick" if quick else "")
    body = study.body.build()
    assert set(body.materials) == set(body.geometry.regions)
    assert study.interaction.build(body).touches in body.geometry.surfaces


def test_a_quick_study_solves_less_and_asks_less():
    for name in SOLIDS:
        whole, quick = preset_study(name), preset_study(name, quick=True)
        assert quick.sweep.samples < whole.sweep.samples
        acting = whole.interaction
        size = acting.shape.build().size if acting.kind == "tool" else acting.radius
        assert quick.sweep.element > size / 2
        if acting.kind != "pad":
            assert quick.interaction.depth[1] < whole.interaction.depth[1]
        for key, value in quick.target:
            if key not in {"smoothness", "coverage", "loop_work"}:
                assert value >= getattr(whole.target, key), key


def study_file(tmp_path, text: str):
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_are_allowed_and_kept_in_si(tmp_path):
    study = read_study(
        study_file(
            tmp_path,
            """
            name = "cube"
            [body]
            kind = "block"
            size = ["4 cm", "40 mm", 0.04]
            material = { young = "12 kPa", poisson = 0.4 }
            [interaction]
            kind = "probe"
            radius = "6 mm"
            pad = "3 N/mm^3"
            over = [["1 cm", "1 cm"], ["3 cm", "3 cm"]]
            [sweep]
            element = "4 mm"
            """,
        )
    )
    assert study.body.size == pytest.approx((0.04, 0.04, 0.04))
    assert study.interaction.pad == pytest.approx(3e9)
    assert study.body.build().materials["body"].young == pytest.approx(12e3)
    # a quarter is solved, the whole is shown
    assert study.problem().interactions[0].over == ((0.02, 0.02), (0.03, 0.03))
    assert study.problem(whole=True).interactions[0].over == ((0.01, 0.01), (0.03, 0.03))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '[body]\nkind = "blok"',
            "no kind of body 'blok'; there are cantilever, block, layered, dome, cylinder, organ, part; "
            "did you mean 'block'",
        ),
        ('[body]\nkind = "block"\nsiez = [1, 1, 1]', "did you mean 'size'"),
        # of the keys of that table, though another has a nearer one
        (
            '[body]\nkind = "block"\n[sweep]\ndepht = 3',
            "sweep.depht: there is no such key; did you mean 'depths'",
        ),
        (
            '[body]\nkind = "block"\n[interaction]\ndepht = 3',
            "interaction.depht: there is no such key; did you mean 'depth'",
        ),
        (
            '[body]\nkind = "layered"\nlayers = [{name = "skin", thicknes = 0.01}]',
            "thicknes: there is no such key; did you mean 'thickness'",
        ),
        ('[body]\nkind = "block"\nfixed = "botom"', "no surface 'botom'"),
        ('[body]\nkind = "dome"\nmaterial = "ecoflex"', "There is no material called 'ecoflex'"),
        (
            '[body]\nkind = "block"\n[interaction]\nradius = "1 kg"',
            "interaction.radius: '1 kg' is not a quantity in m",
        ),
        ('[body]\nkind = "block"\n[interaction]\ndepth = [0.01, 0.002]', "is no range"),
        (
            '[body]\nkind = "block"\n[interaction]\ndepth = ["0.2 mm", "-2 mm"]',
            'for example depth = ["0.2 mm", "5 mm"]',
        ),
        ('[body]\nkind = "block"\n[sweep]\nsamples = 8\ndepths = 9', "no depth series"),
        ('[body]\nkind = "block"\n[learning]\nsecond = 3', "learning.second: there is no such key"),
        ("[learning]\nseconds = 3", "learning.seconds: there is no such key here"),
        ('[body]\nkind = "layered"', "body.layers"),
        ('[body]\nkind = "block"\n[[varied]]\npath = "young"\nlow = "2 mm"\nhigh = 1', "varied.0.low"),
        ('[body]\nkind = "block"\n[[varied]]\npath = "young"\nlow = 2\nhigh = 1', "is no range"),
        (
            '[body]\nkind = "block"\n[[varied]]\npath = "density"\nlow = "1 kPa"\nhigh = 2',
            "a density can't vary",
        ),
    ],
)
def test_mistakes_are_told_by_their_place(tmp_path, text, words):
    with pytest.raises(StudyError) as caught:
        read_study(study_file(tmp_path, text))
    assert words in str(caught.value)


def test_a_file_without_a_kind_is_of_a_beam(tmp_path):
    assert read_study(study_file(tmp_path, 'name = "b"')).body.kind == "cantilever"


def test_a_target_of_zero_asks_nothing():
    limits = preset_study("block", quick=True).target.limits()
    assert limits.smoothness is None
    assert limits.interval_coverage is None
    assert preset_study("block").target.limits().interval_coverage == (0.80, 0.97)


@pytest.mark.full
def test_columns_have_their_depths_and_tests_have_other_places():
    study = preset_study("block", quick=True)
    problem = study.problem()
    train, test = (part.arguments(problem)["points"] for part in (study.sweep, study.test))
    assert (len(train), len(test)) == (study.sweep.samples, study.test.samples)
    columns = study.sweep.samples // study.sweep.depths
    assert [len(rows) for rows in problem.chains(train)] == [study.sweep.depths] * columns
    assert not {tuple(p) for p in train[:, :2]} & {tuple(p) for p in test[:, :2]}


FAMILY = """
[body]
kind = "layered"
layers = [
    { name = "fat", thickness = "9 mm", material = { young = "4 kPa" } },
    { name = "muscle", thickness = "31 mm", material = { young = "15 kPa" } },
]
[interaction]
over = [["20 mm", "20 mm"], ["80 mm", "80 mm"]]
[[varied]]
path = "fat.thickness"
low = "7 mm"
high = "11 mm"
[[varied]]
path = "muscle.young"
low = "8 kPa"
high = 30e3
[sweep]
samples = 12
depths = 3
[test]
samples = 8
depths = 2
"""


@pytest.mark.full
def test_a_family_of_bodies_has_its_numbers_as_inputs(tmp_path):
    study = read_study(study_file(tmp_path, FAMILY))
    assert read_study(study_file(tmp_path, to_toml(study))) == study
    problem = study.problem()
    assert [(r.name, r.low, r.high, r.unit) for r in problem.ranges[3:]] == [
        ("fat.thickness", 0.007, 0.011, "m"),
        ("muscle.young", 8e3, 30e3, "Pa"),
    ]
    train, test = (part.arguments(problem)["points"] for part in (study.sweep, study.test))
    assert (train.shape, test.shape) == ((12, 5), (8, 5))
    # each column is of a body of its own, and those of the test are others
    assert len({tuple(x) for x in train[:, 3:]}) == 4
    assert not {tuple(x) for x in train[:, 3:]} & {tuple(x) for x in test[:, 3:]}
    assert problem.member(train[0, 3:]).body.geometry.layers[0][1] == pytest.approx(train[0, 3])


def test_what_can_vary_is_told_where_a_path_names_nothing(tmp_path):
    study = read_study(study_file(tmp_path, FAMILY.replace("muscle.young", "bone.young")))
    with pytest.raises(UsageError, match="Its regions are fat, muscle"):
        study.problem()


def test_a_touch_study_takes_another_name():
    assert preset_study("block").renamed("mine").name == "mine"


def test_workers_solve_and_learn():
    fewer = preset_study("block").with_workers(3)
    assert (fewer.sweep.workers, fewer.learning.workers) == (3, 3)
    beam = preset_study("beam-copper").with_workers(3)  # is learnt in one process
    assert beam.sweep.workers == 3
    assert beam.learning == preset_study("beam-copper").learning
    assert beam.with_workers(None) == beam


@pytest.mark.parametrize("name", preset_names())
def test_every_study_takes_a_number_of_workers(name):
    study = preset_study(name)
    assert study.with_workers(2).name == study.name


def test_a_target_of_the_first_version_keeps_its_meaning(tmp_path):
    text = 'name = "old"\n[[loads]]\nname = "P"\nlow = 0\nhigh = 2\n[target]\nfilter_relapse = 3.0'
    assert read_study(study_file(tmp_path, text)).target.filter_regression == 3.0


FIRST_VERSION = {
    'name = "old"\n[[loads]]\nname = "P"\nlow = 0\nhigh = "2 N"': {
        "loads": [{"name": "P", "low": 0, "high": 2}]
    },
    'name = "old"\n[body]\nkind = "block"\n[probe]\nradius = "8 mm"': {"kind": "probe", "radius": 0.008},
}


@pytest.mark.parametrize("text", FIRST_VERSION)
def test_files_of_the_first_version_are_read(text, tmp_path):
    study = read_study(study_file(tmp_path, text))
    assert study == Study.model_validate(
        {"name": "old", "body": {"kind": study.body.kind}, "interaction": FIRST_VERSION[text]}
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[interaction]\nkind = "probe"', "a cantilever takes the interaction loads, not probe"),
        (
            '[interaction]\nkind = "prob"',
            "no kind of interaction 'prob'; there are loads, probe, tool, pinch, pad; did you mean",
        ),
        ('[body]\nmaterial = "annealed copper"', "remembers its history: give a table [memory]"),
        ("[memory]\nhistories = 3", "which 'nylon' does not"),
        (
            '[body]\nmaterial = "annealed copper"\n[memory]\n[sweep]\nsamples = 3',
            "sweep: a study of a body with memory has no table [sweep]",
        ),
        ('[[varied]]\npath = "young"\nlow = 1\nhigh = 2', "nothing of a cantilever can vary"),
        (
            '[body]\nkind = "block"\n[filter]\npasses = 3',
            "filter: a study with the interaction probe has no table [filter]",
        ),
    ],
)
def test_parts_that_do_not_fit_together_are_refused(text, words, tmp_path):
    with pytest.raises(StudyError) as caught:
        read_study(study_file(tmp_path, text))
    assert words in str(caught.value)
