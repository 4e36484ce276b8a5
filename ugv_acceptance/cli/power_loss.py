"""Whether the robot tips when its power goes, for `ugv-acceptance model --power-loss`."""

import math
from typing import Any

from rich.markup import escape

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.robot_description import payload_from, posture_from, tilted_gravity
from ugv_acceptance.cli.terminal_output import (
    console_of,
    print_table,
    say,
    status,
    table_of,
)
from ugv_acceptance.config import Config
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.report.format import number_text

Values = dict[str, Any]

MEANING = {
    'TIPS': ('red', 'the robot tips at every damping of its joints that was simulated'),
    'MAY TIP': ('red', 'at some dampings of its joints it tips, or turns by more than 5 deg'),
    'NOT SEEN TO TIP': ('yellow', 'no simulated fall tipped it; that does not exclude it'),
}
ASSUMED = (
    'Assumed: flat ground, friction 0.8, wheels or tracks do not roll, the gripper keeps its load,'
    ' joints stop at the ends of their travel.'
)


def braked_from(robot: Robot, text: str) -> tuple[str, ...]:
    """Return the joints of 'NAME,NAME'; raises BadConfig where one is not measured."""
    names = tuple(part.strip() for part in text.split(',') if part.strip())
    for name in names:
        if name not in robot.joint_names:
            known = ', '.join(robot.joint_names) or 'none'
            raise BadConfig(f'--braked: expected a measured joint ({known}), got {name}')
    return names


def describe_power_loss(
    config: Config, posture: str, tilt: str, payload: str, braked: str
) -> Values:
    """Return the answer, the falls it rests on and the brakes; arguments are those of the verb."""
    robot = config.settings.robot
    q, load = posture_from(robot, posture), payload_from(robot, payload)
    held, gravity = braked_from(robot, braked), tilted_gravity(robot, tilt)
    if not robot.contacts:
        raise BadConfig('--power-loss: expected contacts in the configuration, got none')
    from ugv_acceptance.cli.simulate import say_balanced
    from ugv_acceptance.simulation.power_loss import Released, power_loss

    say_balanced(robot)
    with status('Letting the joints go in the simulation'):
        found = power_loss(Released(robot, tuple(q), load, gravity, held))
    return {
        'answer': found.answer,
        'stands_with_power': found.stood,
        'braked': list(held),
        'falls': [
            {
                'damping_ratios': list(fall.damping),
                'largest_turn_deg': None if fall.tips else math.degrees(fall.turn),
                'tips': fall.tips,
            }
            for fall in found.falls
        ],
        'brakes': [
            {
                'joint': brake.joint,
                'torque': brake.torque,
                'torque_unit': robot.joint(brake.joint).units.effort,
                'fall_m': brake.fall,
                'energy_j': brake.energy,
                'carries_the_robot': brake.carries,
            }
            for brake in found.brakes
        ],
        'assumed': ASSUMED,
    }


def print_power_loss(found: Values) -> None:
    """Print the answer and its two tables."""
    console = console_of()
    colour, meaning = MEANING[found['answer']]
    held = ', '.join(found['braked'])
    answer = f'If the power goes: [{colour}]{found["answer"]}[/]: {meaning}'
    say(console, answer)
    if not found['stands_with_power']:
        say(console, '[red]With power it does not stand in this posture either.[/]')
    say(console, f'Held by brakes: {escape(held) or "no joint"}')
    falls = table_of('Simulated falls', 'damping ratios', 'largest turn deg', 'tips')
    for fall in found['falls']:
        turn = f'{fall["largest_turn_deg"]:.1f}' if not fall['tips'] else 'over 30'
        ratios = fall['damping_ratios']
        shown = ratios[:1] if len(set(ratios)) == 1 else ratios
        text = ' '.join(f'{ratio:g}' for ratio in shown)
        falls.add_row(text, turn, 'yes' if fall['tips'] else 'no')
    print_table(console, falls)
    brakes = table_of('What a brake would hold here', 'joint', 'torque', 'falls m', 'energy J')
    for brake in found['brakes']:
        torque = f'{number_text(brake["torque"])} {brake["torque_unit"]}'
        more = " and the ground's load" if brake['carries_the_robot'] else ''
        row = (number_text(brake['fall_m'], 2), number_text(brake['energy_j']))
        brakes.add_row(escape(brake['joint']), torque + more, *row)
    print_table(console, brakes)
    say(console, found['assumed'])
    say(console, answer)
