"""Mutants of a source for mutation testing: one small change of one expression each.

A comparison, an operator, a constant, a sign or a choice is turned into another; a number over 1000
is doubled, for one more would be lost in it. Decorators are left as they are: `slots` and `frozen`
forbid what no code does, and a cache's size changes no value. So is `strict` of zip: it guards what
is of one length already. Those in EQUIVALENT change nothing that anybody could see; they are left
out and printed with the reason.
"""

import ast
from dataclasses import dataclass
from typing import Any

_COMPARE: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
}  # fmt: skip
_BINARY: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.FloorDiv: ast.Mult,
}  # fmt: skip
# (file, function, change) -> why no test can tell it from the code.
EQUIVALENT: dict[tuple[str, str, str], str] = {
    ('model/blocks.py', '', '65536 -> 131072'): 'larger blocks give the same values',
    ('model/hull.py', '', '50 -> 51'): 'the hulls of the rest are found one by one',
    ('model/row_selection.py', '', '4096 -> 8192'): 'counted or sorted, the values are the same',
    ('model/row_selection.py', 'groups', 'high - low < _FEW -> high - low <= _FEW'): 'the same',
    ('model/row_selection.py', 'groups', 'high - low -> high + low'): 'the same',
    ('model/stability.py', '_state', '2 -> 3'): 'WEIGHTLESS is 1 m/s2, to any power',
    ('model/expressions.py', '_node',
     '_order(args[1]) < _order(args[0]) -> _order(args[1]) <= _order(args[0])'):
        'equal are only an operand and itself',
    ('model/expressions.py', '_order', '0 -> 1'):
        'numbers still come before nodes: these are ordered by their address, which is larger',
    ('model/expressions.py', '_order', '1 -> 2'): 'the same',
    ('evaluation/inputs/joints.py', 'JointMerger.merge_columns',
     'len(useful) > 1 -> len(useful) >= 1'):
        'one segment is in order already',
    ('evaluation/alerts/state_machine.py', 'Signal', '-np.inf -> +np.inf'):
        'a peak is set before it is read',
    ('evaluation/alerts/state_machine.py', 'Signal.step',
     'value > self.peak -> value >= self.peak'):
        'a value as bad as the peak leaves everything as it is',
    ('evaluation/downsampling.py', 'Sampler', '1 -> 2'): 'no slot is below 0',
    ('evaluation/inputs/low_pass.py', 'LowPass', '0 -> 1'):
        'nothing is carried to the first sample',
    ('evaluation/inputs/low_pass.py', 'LowPass.columns', '8.0 -> 9.0'):
        'longer stretches, same values',
    ('evaluation/inputs/low_pass.py', 'LowPass.columns', 'elapsed / 8.0 -> elapsed * 8.0'):
        'shorter stretches, same values',
    ('evaluation/inputs/low_pass.py', 'LowPass.columns',
     'np.diff(np.floor(elapsed / 8.0)) > 0 -> np.diff(np.floor(elapsed / 8.0)) >= 0'): 'the same',
    ('evaluation/criteria/verdict.py', '_measured',
     "distance > 0.0 >= bound['excess'] -> distance >= 0.0 >= bound['excess']"):
        'a distance of 0 is false before that',
    ('evaluation/inputs/timeouts.py', 'InputTimeout', '0 -> 1'): 'the first message sets both',
    ('evaluation/inputs/imu.py', 'ImuTracker', '0.0 -> 1.0'): 'the first message sets it',
    ('evaluation/inputs/imu.py', 'ImuTracker', 'False -> True'):
        'what is quiet is judged quiet, a call is saved',
    ('evaluation/inputs/imu.py', 'ImuTracker.columns', 'none != 0 -> none == 0'):
        'there are no rows',
    ('evaluation/inputs/joints.py', 'JointMerger.layout',
     '64 -> 65'): "a cache's size changes no value",
    ('evaluation/inputs/joint_rows.py', '', '1 -> 2'): 'no time is below 0',
    ('evaluation/recorded.py', 'RecordedEvaluator._table', '0.0 -> 1.0'):
        'what stands in for a posture that is not whole is not read',
    ('evaluation/recorded.py', 'RecordedEvaluator.__post_init__', 'never < 0 -> never <= 0'):
        'whether the row before the first is usable is not read',
    ('evaluation/recorded.py', 'RecordedEvaluator.__post_init__', '0 -> 1'): 'the same',
    ('evaluation/recorded.py', '', '1 -> 2'): 'no row and no time is below 0',
    ('evaluation/margin_watch.py', '_watch_stand',
     'watch.slide.on < np.inf -> watch.slide.on <= np.inf'):
        'nothing slides where friction is not known, a call is saved',
    ('evaluation/recorded.py', 'RecordedEvaluator._watch_joints',
     'signal.on < np.inf -> signal.on <= np.inf'):
        'no rate reaches an infinite limit, a call is saved',
    ('evaluation/live.py', 'LiveEvaluator._watch',
     'watch.slide.on < math.inf -> watch.slide.on <= math.inf'): 'the same',
    ('evaluation/live.py', 'LiveEvaluator.joint_state', '-signal.on -> +signal.on'):
        'a small value changes nothing, calls are saved',
    ('evaluation/summary.py', 'Extreme', '0 -> 1'): 'a time is set with the first value',
    ('evaluation/criteria/measurement.py', 'ValueMeasure._see', '1.0 -> 2.0'):
        'the size of a sign changes no order',
    ('evaluation/criteria/measurement.py', 'ValueMeasure._see',
     'order[k] >= sign * self.worst[-1].value -> order[k] > sign * self.worst[-1].value'):
        'of equal moments nsmallest keeps the earlier',
    ('evaluation/alerts/state_machine.py', 'Signal', 'True -> False'):
        'quiet saves work: no value depends on it',
    ('evaluation/alerts/state_machine.py', 'Signal.advance',
     'self.alert is None -> self.alert is not None'):
        'never quiet, and the same',
    ('evaluation/alerts/state_machine.py', 'Signal.advance',
     'self.due is None -> self.due is not None'):
        'the same',
    ('evaluation/alerts/prediction.py', '_ahead', 'len(time) > OVER -> len(time) >= OVER'):
        'of so few looks there is no rate: empty arrays',
    ('evaluation/alerts/prediction.py', 'Prediction.values', '0.0 -> 1.0'):
        'where there is no limit a warning begins at infinity',
    ('evaluation/effort/plateaus.py', 'EffortComparison.plateaus', '0.0 -> 1.0'):
        'only efforts above ten are held to the largest of the run',
    ('evaluation/advice/search.py', '_loads',
     'cases[0].payload.mass <= 0.0 -> cases[0].payload.mass < 0.0'):
        'an empty hand gains nothing by being emptied',
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Mutant:
    """A change: of the `place`-th node of ast.walk, in `function`; its statement's `lines`."""

    file: str
    place: int
    function: str
    change: str
    lines: range

    @property
    def text(self) -> str:
        """Where and what, on one line."""
        return f'{self.file}:{self.lines[-1]} {self.function}: {self.change}'


def mutants(file: str, source: str) -> list[Mutant]:
    """Return every mutant of a source, those that are equivalent too."""
    tree = ast.parse(source)
    around = dict[ast.AST, tuple[str, int]]()
    for node in ast.walk(tree):  # parents come before their children
        name, line = around.get(node, ('', 1))
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f'{name}.{node.name}'.lstrip('.')
        if isinstance(node, ast.stmt):
            line = node.lineno
        around.update(dict.fromkeys(ast.iter_child_nodes(node), (name, line)))
        around[node] = name, line
    decorators = (d for n in ast.walk(tree) for d in getattr(n, 'decorator_list', ()))
    keywords = (k for k in ast.walk(tree) if isinstance(k, ast.keyword))
    guards = (k.value for k in keywords if ast.unparse(k) == 'strict=True')
    left = {node for kept in (*decorators, *guards) for node in ast.walk(kept)}
    found = []
    for k, node in enumerate(ast.walk(tree)):
        before = ast.unparse(node) if isinstance(node, ast.expr) else ''
        if isinstance(node, ast.expr) and node not in left and _change(node):
            name, first = around[node]
            lines = range(min(first, node.lineno), (node.end_lineno or first) + 1)
            found.append(Mutant(file, k, name, f'{before} -> {ast.unparse(node)}', lines))
    return found


def mutated(source: str, place: int) -> str:
    """Return a source with its `place`-th node changed."""
    tree = ast.parse(source)
    node: Any = list(ast.walk(tree))[place]
    _change(node)
    return ast.unparse(tree)


def _change(node: ast.expr) -> bool:
    """Change a node in place; return whether there was a change to make."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _COMPARE:
        node.ops[0] = _COMPARE[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        node.op = _BINARY[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        node.value = not node.value
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        node.value += node.value if abs(node.value) > 1000 else 1
    elif isinstance(node, ast.IfExp):
        node.body, node.orelse = node.orelse, node.body
    else:
        return False
    return True
