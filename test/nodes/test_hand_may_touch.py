"""A live monitor of an arm on the ground: an alert, and what an operator may say to it."""

import math

from nodes.live_case import ERROR, OK, STALE, Live, session_of

# The hand hangs from a raised arm to 3 cm below the ground, over the tracks' front.
DOWN = (0.0, math.radians(50.0), math.radians(-140.0), 2.0)
FRESH = {'payload__mass_kg': 0.0}


def test_an_operator_permits_the_hand_to_touch(live: Live) -> None:
    """On the ground nothing is OK; after a word on ~/operator tilt is known, torque is not."""
    monitor, driver = live.running(**FRESH)

    def down() -> None:
        driver.send(DOWN)

    live.until(lambda: any('ARM_ON_GROUND' in a.name for a in driver.alerts), down)
    live.until(lambda: driver.verdicts[-1].level[0] in (ERROR, STALE), down)
    assert session_of(monitor).evaluator.margins is None
    assert 'no margin is valid' in driver.verdicts[-1].message
    driver.operate('hand_may_touch', 'Ada', allowed='perhaps')  # logged, and refused

    def permit() -> None:
        driver.operate('hand_may_touch', 'Ada', allowed='true')
        down()

    live.until(lambda: monitor.get_parameter('hand_may_touch').value, permit)
    live.until(lambda: 'torque not judged' in driver.verdicts[-1].message, down)
    live.until(
        lambda: (
            'deg to tipping: ' in driver.verdicts[-1].message
            and {'hand_may_touch', 'True'}
            <= {x for v in driver.verdicts[-1].values for x in (v.key, v.value)}
        ),
        down,
    )
    live.until(lambda: not session_of(monitor).evaluator.watch.active, driver.send)
    assert session_of(monitor).evaluator.level == OK
