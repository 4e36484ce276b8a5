"""Says what the records of operators' drills tell of a result, in lines of text."""

from ugv_acceptance.type_aliases import Json


def training_lines(result: Json) -> list[str]:
    """Return one line for each operator's drill, and one where a required one is missing.

    Such as 'operator training: Ada: drill passed, 2026-05-04, 24 min'.
    """
    told = result.get('operator_training')
    if told is None:
        return []
    lines = [training_line(one) for one in told['records']]
    lines = lines or ['no record of a drill, and the criteria require one']
    return [f'operator training: {line}' for line in lines]


def training_line(one: Json) -> str:
    """Return what one record of a result tells, and what speaks against it.

    Such as 'Ada: drill to repeat (slope, load), 2026-05-04, 24 min'.
    """
    names = {'to repeat': one['to_repeat'], 'incomplete': one['not_done']}.get(one['outcome'], [])
    which = f' ({", ".join(names)})' if names else ''
    line = f'{one["operator"]}: drill {one["outcome"]}{which}, {one["started"][:10]}'
    return '; '.join([f'{line}, {one["minutes"]:.0f} min', *one['remarks']])


def training_rows(one: Json) -> list[Json]:
    """Return the situations of a record for a table: title, passed, tries, answers, happened.

    The last try of each counts; one that was not done has `passed` None.
    """
    tries: dict[str, list[Json]] = {}
    for of in one['situations']:
        tries.setdefault(of['situation'], []).append(of)
    rows = [
        {
            'title': of[-1]['title'],
            'passed': of[-1]['passed'],
            'tries': len(of),
            'answers': [f'{a["key"]} after {a["after_s"]:.1f} s' for a in of[-1]['answers']],
            'happened': of[-1]['happened'],
        }
        for of in tries.values()
    ]
    empty: Json = {'passed': None, 'tries': 0, 'answers': [], 'happened': ''}
    return [*rows, *({'title': name, **empty} for name in one['not_done'])]
