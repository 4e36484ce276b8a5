"""Contact points of robots of other people, beside what a person measures in their URDFs."""

import pytest

from bench.bench_contact_points import MEASURED, ROBOTS, Row, row_of
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.contact_points import derive_contacts
from ugv_acceptance.configure.draft import ASK, CERTAIN

# What has to be asked: a tilt, legs without a posture, an arm that stands on nothing.
ASKED = {
    'dingo': 'is this tilt real?',
    'go2, legs at 0': 'is that how the robot stands?',
    'b1, legs at 0': 'is that how the robot stands?',
    'anymal_c, legs at 0': 'is that how the robot stands?',
    'z1': 'only an arm: what is it mounted on?',
}
ABITOBOT = ROBOTS.parent / 'bags' / 'abitobot' / 'robot.urdf'


@pytest.fixture(scope='module')
def rows() -> dict[str, Row]:
    """Return every robot's derived points beside the measured ones."""
    if not ROBOTS.is_dir():
        pytest.skip(f'no robots of other people: {ROBOTS} is absent')
    return {name: row_of(name, measured) for name, measured in MEASURED.items()}


@pytest.mark.parametrize('name', MEASURED)
def test_no_wrong_contact_is_accepted_in_silence(rows: dict[str, Row], name: str) -> None:
    """Each robot's points are those that a person measures, to 0.1 mm, or the doubt is asked."""
    row = rows[name]
    assert row.off < 1e-4
    assert row.verdict == ('asked' if name in ASKED else 'right')
    assert ASKED.get(name, '') in row.contacts.question
    assert all(one.source and one.on for one in row.contacts.points)


def test_points_of_wheels_are_on_what_does_not_spin(rows: dict[str, Row]) -> None:
    """No contact point is on a link whose name says wheel."""
    wheels = [o for row in rows.values() for o in row.contacts.points if o.on.startswith('wheel')]
    assert len(wheels) == 5 * 8 + 2 * 4 + 6
    assert not [one for one in wheels if 'wheel' in one.contact.link]


def test_what_only_stands_for_a_wheel_or_caster_is_no_certainty(rows: dict[str, Row]) -> None:
    """TIAGo's balls, TurtleBot3's boxes, and Leo's wheels beside a mesh that is not read."""
    for name in ('tiago', 'leo', 'tb3_manip'):
        doubted = [o for o in rows[name].contacts.points if o.grade != CERTAIN]
        assert len(doubted) == {'tiago': 6, 'leo': 8, 'tb3_manip': 2}[name]


def test_wheels_of_abitobot_are_asked_about() -> None:
    """Its meshes are not there: a radius by the inertia is a guess, as in its configuration."""
    if not ABITOBOT.is_file():
        pytest.skip(f'no robot of other people: {ABITOBOT} is absent')
    found = derive_contacts(read_urdf(ABITOBOT.read_bytes(), 'abitobot'), {}, lambda _: None)
    assert {one.grade for one in found.points} == {ASK}
    assert found.ground.value == pytest.approx(-1.10545, abs=0.002)
    assert 'a radius of 339.0 mm: is it that?' in found.question
