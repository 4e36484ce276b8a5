"""Prints what `info` found: one screen of 80 columns and 24 lines, or all there is."""

import math
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from ugv_acceptance.cli.terminal_output import COLOURS, MARKS, say
from ugv_acceptance.type_aliases import Json

# Lines of the screen, one of them for the next prompt; topics shown; sentences, characters of one.
SCREEN, TOPICS, MOST, LONGEST = 23, 5, 3, 134
# Columns of a page; a name is shortened to no less than this.
WIDE, NARROW = 80, 12
STORAGES = {'mcap': 'MCAP', 'sqlite3': 'SQLite', 'ros1': 'ROS 1 bag'}
GUARDED = {
    'all': 'every chunk has a checksum',
    'part': 'some chunks have no checksum',
    'none': 'no checksums: damage may go unnoticed',
}
INPUTS = {'joint_states': 'joints', 'imu': 'imu', 'payload': 'payload'}
KB = 1000.0
# A rate (Hz) that no topic has.
SILLY = 1e5


def print_info(told: Json, asked: Sequence[Path], console: Console, *, verbose: bool) -> None:
    """Print what `info` found of the paths asked for; without `verbose` on one screen."""
    head = _lines(console, [*_recording(told, verbose=verbose)])
    robot = _lines(console, _robot(told, verbose=verbose))
    last = _lines(console, _last(told, asked))
    could = _lines(console, _could(told, verbose=verbose))
    could_not = _lines(console, _could_not(told, verbose=verbose))
    topics = _topics(told['topics'], verbose=verbose)
    if not verbose:
        room = SCREEN - sum(map(len, (head, robot, last, topics, could)))
        could_not = _fitted(could_not, room)
    for line in (*head, *topics, *robot, *could, *could_not, *last):
        console.out(line, highlight=False)


def _fitted(lines: list[str], room: int) -> list[str]:
    if len(lines) <= room:
        return lines
    return [*lines[: max(room - 1, 1)], '  ... -v lists all']


Sentence = tuple[str, int]


def _lines(console: Console, sentences: Iterable[Sentence]) -> list[str]:
    """Return sentences (markup, indent) as the lines that a console prints of them."""
    with console.capture() as captured:
        for text, indent in sentences:
            say(console, text, indent)
    return captured.get().splitlines()


def _recording(told: Json, *, verbose: bool) -> Iterable[Sentence]:
    one = told['recording']
    paths = one['paths']
    more = f' and {len(paths) - 1} more files' if len(paths) > 1 else ''
    yield f'[bold]{escape(paths[0])}[/]{more}', 0
    if verbose:
        yield from ((escape(path), 4) for path in paths[1:])
    kind = ', '.join([STORAGES[one['storage']], *one['compression']])
    parts = [
        f'{one["duration_s"]:.1f} s from {one["start"] or "an unknown time"}',
        f'{one["messages"]} messages',
        size_words(one['size_bytes']),
        kind,
        *([GUARDED[one['protected']]] if one['protected'] else []),
        *(['simulated, as it says'] if one['simulated'] else []),
    ]
    yield escape('; '.join(parts)), 2
    odd = [*([one['salvaged']] if one['salvaged'] else []), *one['findings']]
    shown = odd if verbose else odd[:2]
    yield from ((f'[yellow]{escape(_short(text, verbose=verbose))}[/]', 2) for text in shown)
    if len(odd) > len(shown):
        yield f'and {len(odd) - len(shown)} more about the files', 2


def size_words(size: int) -> str:
    """Return a size in bytes as text, with three digits."""
    for unit in ('B', 'kB', 'MB', 'GB'):
        if size < KB or unit == 'GB':
            break
        size /= KB  # type: ignore[assignment]
    return f'{size:.3g} {unit}' if size < KB else f'{size:.0f} {unit}'


def _short(text: str, *, verbose: bool) -> str:
    if verbose or len(text) <= LONGEST:
        return text
    return f'{text[:LONGEST].rpartition(" ")[0]} ...'


def _topics(topics: Sequence[Json], *, verbose: bool) -> list[str]:
    """Return the table of topics, as lines."""
    shown = list(topics if verbose else topics[:TOPICS])
    heads = ('topic', 'type', 'messages', 'Hz', 'gap', 'QoS', 'taken for')
    rows = [heads, *(_row(one) for one in shown)]
    if not verbose:
        others = [max(len(row[k]) for row in rows) for k in range(2, len(heads))]
        room = WIDE - sum(others) - 2 * len(heads)
        kinds = min(max(len(row[1]) for row in rows), max(room // 2, NARROW))
        names = max(room - kinds, NARROW)
        rows = [(_cut(row[0], names), _cut(row[1], kinds), *row[2:]) for row in rows]
    widths = [max(len(row[k]) for row in rows) for k in range(len(heads))]
    right = {2, 3, 4}
    lines = [
        '  '
        + '  '.join(
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
    if len(topics) > len(shown):
        messages = sum(one['messages'] for one in topics[len(shown) :])
        lines.append(f'  and {len(topics) - len(shown)} more topics with {messages} messages')
    return lines if topics else ['  no topics']


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f'..{text[2 - most :]}'


def _row(one: Json) -> tuple[str, ...]:
    kind = one['type'].replace('/msg/', '/')
    rate, gap = one['rate_hz'], one['longest_gap_s']
    return (
        one['name'],
        kind.rpartition('/')[2] + ('' if one['encoding'] == 'cdr' else f' ({one["encoding"]})'),
        str(one['messages']),
        '-' if rate is None else f'{rate:.0f}' if KB <= rate < SILLY else f'{rate:.3g}',
        '-' if gap is None else _seconds(gap),
        _qos_words(one['qos']),
        INPUTS.get(one['used_as'] or '', ''),
    )


def _seconds(gap: float) -> str:
    return f'{gap * 1e3:.0f} ms' if gap < 1.0 else f'{gap:.1f} s'


def _qos_words(profiles: Sequence[Json]) -> str:
    words = []
    for one in profiles:
        text = 'best effort' if one['reliability'] == 'best_effort' else 'reliable'
        words.append(text + (', latched' if one['durability'] == 'transient_local' else ''))
    found = list(dict.fromkeys(words))
    text = found[0] if len(found) == 1 else f'{len(found)} kinds' if found else ''
    return text + (f', {len(words)}x' if len(words) > 1 else '')


def _robot(told: Json, *, verbose: bool) -> Iterable[Sentence]:
    robot, known = told['robot'], told['fitting']
    if robot is None:
        yield f'Robot: its joints are those of {escape(", ".join(known))}', 0
        return
    heard = robot['inputs']['joint_states']['topic'] is not None
    yield _joint_words(robot, known) if heard else f'Robot {escape(robot["name"])}', 0
    for name, one in robot['inputs'].items():
        odd = one['topic'] is None and not (name == 'payload' or one['why'].endswith('uses none'))
        if odd:
            yield f'[yellow]{name}: {escape(_short(one["why"], verbose=verbose))}[/]', 2
        elif one['topic'] is not None and 'only' in one['why']:
            yield f'{name} from {escape(one["topic"])}: {one["why"]}', 2
    yield from _description_words(robot, verbose=verbose)
    imu = robot['imu']
    if imu is not None and imu['frames']:
        frames = ', '.join(frame or '(no name)' for frame in imu['frames'])
        place = imu['mounting'] or f'[yellow]not known: {escape(imu["why"])}[/]'
        place = place if verbose else place.partition(': rpy')[0]
        yield f'IMU frame {escape(frames)}, mounting {place}', 2
    for one in told['monitors']:
        hashes = one['limits_hash']
        same = 'these' if hashes == [told['limits_hash']] else 'other'
        by = f', by {same} limits ({", ".join(hashes)})' if hashes else ''
        yield escape(f'a monitor told {one["raised"]} alerts on {one["topic"]}{by}'), 2
    back = [one for one in told['topics'] if one['used_as'] and one['back_by_s'] > 0.0]
    for one in back:
        text = f'log times of {one["name"]} go back by up to {one["back_by_s"]:.3g} s'
        yield f'[yellow]{escape(text)}[/]', 2


def _joint_words(robot: Json, known: Sequence[str]) -> str:
    joints, missing = robot['joints'], robot['joints']['missing']
    total = len(joints['expected'])
    text = f'Robot {escape(robot["name"])}: {total - len(missing)} of {total} joints told'
    if missing:
        near = joints['near']
        listed = (f'{name} ({near[name]}?)' if name in near else name for name in missing)
        text = f'[yellow]{text}; missing: {escape(", ".join(listed))}[/]'
    if joints['extra']:
        extra = joints['extra']
        few = ', '.join(extra[:MOST]) + (' ...' if len(extra) > MOST else '')
        text += f'; {len(extra)} others: {escape(few)}'
    others = [name for name in known if name != robot['name']]
    return text + (f'; fits too: {", ".join(others)}' if others else '')


def _description_words(robot: Json, *, verbose: bool) -> Iterable[Sentence]:
    told = robot['description']
    where = ' and '.join(told['topics'])
    if told['same'] is None:
        if verbose:
            yield 'no robot_description was recorded: the URDF in force is compared with nothing', 2
    elif told['same']:
        yield f'the URDF on {escape(where)} is the one in force', 2
    else:
        text = f'the URDF in force is not that on {where}: {told["difference"]}'
        yield f'[yellow]{escape(_short(text, verbose=verbose))}[/]', 2


def _could(told: Json, *, verbose: bool) -> Iterable[Sentence]:
    def words(one: Json) -> str:
        share = one['share']
        whole = share is None or share >= 0.995
        return str(one['what']) + ('' if whole else f' ({math.floor(100 * share)} % of the time)')

    found = [words(one) for one in told['could_be_judged']]
    colour = COLOURS['OK' if found else 'NO DATA']
    if verbose:
        yield f'[{colour}]Could be judged:[/]{"" if found else " nothing"}', 0
        yield from ((escape(text), 4) for text in found)
    else:
        yield f'[{colour}]Could be judged:[/] {escape("; ".join(found)) or "nothing"}', 0


def _could_not(told: Json, *, verbose: bool) -> Iterable[Sentence]:
    decides = [one for one in told['could_not'] if one['decides']]
    others = [one for one in told['could_not'] if not one['decides']]
    if decides:
        of = 'PASS' if told['can_be_judged'] else 'verdict'
        yield f'[{COLOURS["CAUTION"]}]In the way of a {of}:[/]', 0
    shown = decides if verbose else decides[:MOST]
    yield from ((escape(_short(one['why'], verbose=verbose)), 4) for one in shown)
    if len(decides) > len(shown):
        yield f'and {len(decides) - len(shown)} more', 4
    if verbose and others:
        yield f'[{COLOURS["CAUTION"]}]Not checked:[/]', 0
        yield from ((escape(f'{one["what"]}: {one["why"]}'), 4) for one in others)
    elif others:
        names = '; '.join(one['what'] for one in others)
        yield f'[{COLOURS["CAUTION"]}]Not checked:[/] {escape(names)}', 0


def _last(told: Json, asked: Sequence[Path]) -> Iterable[Sentence]:
    if told['read_until_s'] is not None:
        yield f'the first {told["read_until_s"]:.0f} s were read, --all reads the rest', 0
    robot, names = told['robot'], shlex.join(map(str, asked))
    if told['can_be_judged']:
        of = '' if robot['defaulted'] else f' -c {shlex.quote(_config_word(robot["config"]))}'
        word, text = 'PASS', f'It can be judged: ugv-acceptance evaluate {names}{of}'
    else:
        word, text = 'INCONCLUSIVE', 'As it is, no verdict can be reached'
        if _is_foreign(told):
            text += f'; for another robot: ugv-acceptance init {names} -o robot.yaml'
    yield f'[{COLOURS[word]}]{escape(f"{MARKS[word]} {text}")}[/]', 0


def _is_foreign(told: Json) -> bool:
    """Return whether messages name joints, but none of those of any configuration at hand."""
    joints = told['robot'] and told['robot']['joints']
    nothing_near = joints and joints['missing'] == joints['expected'] and not joints['near']
    return bool(nothing_near and joints['extra'] and not told['fitting'])


def _config_word(path: str) -> str:
    """Return how a configuration is named on the command line: one that ships by its name."""
    at = Path(path)
    return at.stem if at.parent.name == 'msg_configs' else path
