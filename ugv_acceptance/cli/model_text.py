"""Words and tables of `model`: a robot as its files describe it, and its margins in one posture."""

import math
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ugv_acceptance.cli.terminal_output import (
    COLOURS,
    console_of,
    print_table,
    say,
    table_of,
)
from ugv_acceptance.evaluation.ground import CARRIED, UPPER_BOUND, ground_words
from ugv_acceptance.evaluation.margin_words import share_words, tipping_words
from ugv_acceptance.model.stability import RAISED, STATES
from ugv_acceptance.report.format import number_text

Values = dict[str, Any]

# A payload above so many times the robot's own mass is shown as no limit.
_MANY = 10.0


def print_tables(description: Values) -> None:
    """Print a description returned by `describe` as tables."""
    console = console_of()
    say(console, _summary(description))
    _head(console, description)
    print_table(console, _links(description))
    print_table(console, _joints(description))
    _print_carrying(console, description)
    _print_poses(console, description)
    _print_payload(console, description)
    print_table(console, _contacts(description))
    _print_stability(console, description)
    for text in description['warnings']:
        say(console, f'[yellow]warning:[/] {escape(text)}')
    say(console, _summary(description))


def _summary(d: Values) -> str:
    """Return what is nearest to its limit, as markup: a joint, and the least tilt left."""
    limited = [j for j in d['joints'] if j.get('utilisation') is not None]
    told, beyond = [], False
    if limited:
        joint = max(limited, key=lambda j: float(j['utilisation']))
        told.append(f'{joint["name"]} {_share(joint["utilisation"])} of its limit')
        beyond = joint['utilisation'] >= 1.0
    angles = {side: m['tilt_left_deg'] for side, m in d['sides'].items()}
    known = [(angle, side) for side, angle in angles.items() if angle is not None]
    if known:
        angle, side = min(known)
        told.append(tipping_words(side, math.radians(angle)))
        beyond |= angle <= 0.0
    text = '; '.join(told) or 'no limit to compare with'
    state = '' if known else f' ({d["state"]}: no tilt left to tell)'
    colour = COLOURS['FAIL'] if beyond else 'bold'
    mark = 'beyond a limit' if beyond else 'in this posture'
    return f'[{colour}]{escape(d["robot"]["name"])}, {mark}:[/] {escape(text + state)}'


def _head(console: Console, d: Values) -> None:
    serial = d['robot']['serial']
    of_it = f', serial {escape(serial)}' if serial else ''
    say(console, f'[bold]{escape(d["robot"]["name"])}[/]{of_it}')
    console.print(f'config {escape(d["config"]["path"])}', soft_wrap=True)
    console.print(f'urdf   {escape(d["config"]["urdf"])}', soft_wrap=True)
    say(console, f'sha256 {d["config"]["sha256"][:16]}\n')


def _links(d: Values) -> Table:
    table = table_of('Links (centre of gravity in link axes)', 'link', 'kg', 'x m', 'y m', 'z m')
    for link in d['links']:
        if link['mass_kg'] > 0.0:
            table.add_row(escape(link['name']), *_numbers([link['mass_kg']]), *_xyz(link))
    bare = sum(link['mass_kg'] == 0.0 for link in d['links'])
    if bare:
        table.caption, table.caption_justify = f'and {bare} without mass', 'left'
    return table


def _joints(d: Values) -> Table:
    roll, pitch = d['tilt']['roll_deg'], d['tilt']['pitch_deg']
    table = table_of(
        f'Joints in this posture (base: roll {roll:g} deg, pitch {pitch:g} deg)',
        *('joint', 'range', 'at', 'torque', 'limit', 'used'),
    )
    for joint in d['joints']:
        table.add_row(escape(joint['name']), _range(joint), _place(joint), *_torque(joint))
    return table


def _torque(joint: Values) -> tuple[str, str, str]:
    if joint['topic_name'] is None:
        follows = joint['follows']
        return f'follows {escape(follows)}' if follows else 'held', '', ''
    unit, limit, used = joint['torque_unit'], joint['limit'], joint['utilisation']
    torque = f'{number_text(joint["torque"])} {unit}'
    if limit is None:
        return torque, 'passive' if joint['passive'] else 'not judged', ''
    colour = 'red' if used > 1.0 else 'green'
    return torque, f'{limit:g} {unit}', f'[{colour}]{_share(used)}[/]'


def _print_carrying(console: Console, d: Values) -> None:
    """Print what is known of joints between the ground and the body; nothing if none carries."""
    carrying = [joint for joint in d['joints'] if joint.get('carrying')]
    if not carrying:
        return
    table = table_of(
        'Joints that carry the robot: above is the even spread of its weight',
        *('joint', 'hanging', 'even spread', 'least', 'most', 'limit'),
    )
    for joint in carrying:
        of, unit, limit = joint['carrying'], joint['torque_unit'], joint['limit']
        numbers = (of['hanging'], joint['torque'], of['least'], of['most'])
        texts = [f'{number_text(number)} {unit}' for number in numbers]
        texts.append('' if limit is None else f'{limit:g} {unit}')
        table.add_row(escape(joint['name']), *texts)
    print_table(console, table)
    say(
        console,
        'How the contact points share the weight is not measured: torques from least to most '
        'cannot be excluded.\nFriction comes on top where feet, flippers and tracks brace '
        'against each other.\n',
        0,
        0,
    )


def _print_poses(console: Console, d: Values) -> None:
    """Print the named postures, with the joints that are not at 0; nothing if there are none."""
    if not d['poses']:
        return
    joints = {joint['name']: joint for joint in d['joints']}
    table = table_of('Poses, for --posture NAME', 'pose', 'joints that are not at 0', names=2)
    for pose in d['poses']:
        at = pose['positions'].items()
        places = [f'{n} {_place({**joints[n], "position": q})}' for n, q in at if q]
        table.add_row(escape(pose['name']), escape(', '.join(places) or 'none'))
    print_table(console, table)


def _share(used: float) -> str:
    return share_words(used) if used < 100.0 else f'{number_text(used, 0)} x'


def _range(joint: Values) -> str:
    if joint['lower'] is None:
        return 'any'
    scale, unit = _unit(joint)
    return f'{joint["lower"] * scale:g} .. {joint["upper"] * scale:g} {unit}'


def _place(joint: Values) -> str:
    scale, unit = _unit(joint)
    return f'{joint["position"] * scale:.4g} {unit}'


def _unit(joint: Values) -> tuple[float, str]:
    return (1.0, 'm') if joint['unit'] == 'm' else (180.0 / math.pi, 'deg')


def _print_payload(console: Console, d: Values) -> None:
    load = d['payload']
    if load['link'] is None:
        say(console, 'Payload: no payload link is configured\n')
        return
    say(console, f'Payload {load["mass_kg"]:g} kg on {escape(load["link"])}:')
    if not load['holds_itself']:
        text = '[red]the arm is too heavy for its limits without one[/]'
    elif _boundless(d):
        text = 'no joint limit bounds it in this posture; tipping may, see below'
    else:
        left = load['largest_kg'] - load['mass_kg']
        of_it = f'{number_text(abs(left), 2)} kg'
        state = f'{of_it} left' if left >= 0.0 else f'[red]{of_it} too much[/]'
        text = f'the limits allow {number_text(load["largest_kg"], 2)} kg here: {state}'
    say(console, f'{text}\n', 2)


def _boundless(d: Values) -> bool:
    """Return whether the torque limits allow far more payload here than anyone would load."""
    largest, carried = d['payload']['largest_kg'], d['payload']['mass_kg']
    own = sum(link['mass_kg'] for link in d['links'])
    return largest is None or bool(largest > max(carried, _MANY * own))


def _contacts(d: Values) -> Table:
    table = table_of(
        f'Contact points ({d["robot"]["root"]})',
        'point',
        'link',
        'x m',
        'y m',
        'z m',
        'polygon',
        names=2,
    )
    for contact in d['contacts']:
        xyz = _numbers(contact['position_m'])
        corner = 'corner' if contact['corner'] else ''
        table.add_row(escape(contact['name']), escape(contact['link']), *xyz, corner)
    return table


def _print_stability(console: Console, d: Values) -> None:
    x, y, z = _numbers(d['centre_of_gravity_m'])
    mass = number_text(d['total_mass_kg'], 2)
    say(console, f'Total mass {mass} kg with payload, centre of gravity {x} {y} {z} m')
    if d['imu']:
        say(console, f'IMU: {escape(d["imu"])}')
    names = ' '.join(d['support_polygon']) or 'none'
    say(console, f'Support polygon: {escape(names)} ({d["state"]})')
    arm = d['clearance']
    if arm['height_m'] is not None:
        height = number_text(arm['height_m'], 2)
        say(console, f'Arm: {escape(arm["lowest"])} is lowest, {height} m above the ground')
    cautious = _print_ground(console, d)
    title = 'Tilt left before tipping' + (f' ({UPPER_BOUND})' if cautious else '')
    table = table_of(title, 'side', 'deg', 'restoring N m', 'energy J')
    for side, margin in d['sides'].items():
        angle = margin['tilt_left_deg']
        text = '-' if angle is None else _tilt(angle, bound=bool(cautious))
        row = (margin['restoring_moment_nm'], margin['energy_j'])
        table.add_row(side, text, *('-' if value is None else number_text(value) for value in row))
    print_table(console, table)


def _print_ground(console: Console, d: Values) -> Values | None:
    """Print what the ground is taken for; return the cautious margins (deg) where not flat."""
    ground = d['ground']
    cautious: Values | None = ground['cautious_deg']
    text = f'Ground: {ground_words(ground["kind"])}'
    if cautious:
        known = [f'{side} {angle:.1f}' for side, angle in cautious.items() if angle is not None]
        text += (
            ', so the tilt left is an upper bound; taken cautiously (half of '
            f'{ground["pitch_m"]:g} m cut from each end of the tracks), deg: {", ".join(known)}'
        )
    elif d['state'] == STATES[RAISED]:
        text += f'; {CARRIED}'
    say(console, escape(text))
    return cautious


def _tilt(angle: float, *, bound: bool) -> str:
    """Return a tilt left (deg), coloured: an upper bound is never green."""
    good = '<= {:.1f}' if bound else '[green]{:.1f}[/]'
    return (good if angle > 0 else '[red]{:.1f}[/]').format(angle)


def _xyz(link: Values) -> list[str]:
    return _numbers(link['centre_of_gravity_m'])


def _numbers(values: list[float]) -> list[str]:
    return [f'{round(value, 3) + 0.0:.3f}' for value in values]
