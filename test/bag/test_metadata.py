"""metadata.yaml of many topics: read as YAML says, however alike the topics are."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ugv_acceptance import BadBag
from ugv_acceptance.bag.metadata import Metadata, read_metadata

# The one that is used for metadata.yaml; they differ in where a tab may stand.
LOADER: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
QOS = [{'history': 'unknown', 'deadline': {'sec': 9223372036, 'nsec': 854775807}}]


def text_of(topics: list[tuple[str, int]], *, by_name: bool = False) -> str:
    """A metadata.yaml of these topics, with its keys as rosbag2 or by name as rosbags has them."""
    held = [
        {
            'topic_metadata': {
                'name': name,
                'type': f'std_msgs/msg/Float{32 * (1 + i % 2)}',
                'offered_qos_profiles': [{**profile} for profile in QOS],
            },
            'message_count': count,
        }
        for i, (name, count) in enumerate(topics)
    ]
    info = {
        'version': 9,
        'message_count': sum(count for _, count in topics),
        'topics_with_message_count': held,
        'relative_file_paths': ['a_0.mcap', 'a_1.mcap'],
    }

    class Plain(yaml.SafeDumper):
        """Without anchors."""

        def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 (its signature)
            return True

    whole = {'rosbag2_bagfile_information': info}
    return str(yaml.dump(whole, Dumper=Plain, sort_keys=by_name))


def said(folder: Path, text: str) -> Metadata | str:
    """What is read from a text, or the error."""
    (folder / 'metadata.yaml').write_bytes(text.encode())
    try:
        return read_metadata(folder)
    except BadBag:
        return 'broken'


def by_yaml(text: str) -> Metadata | str:
    """What YAML says of it."""
    try:
        whole = yaml.load(text.encode(), Loader=LOADER)  # noqa: S506 (a safe loader)
        info = whole['rosbag2_bagfile_information']
        counts = {
            str(t['topic_metadata']['name']): int(t['message_count'])
            for t in info.get('topics_with_message_count') or ()
        }
        files = tuple(str(name) for name in info.get('relative_file_paths') or ())
        return Metadata(files, int(info['message_count']), counts)
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError):
        return 'broken'


@pytest.mark.parametrize('by_name', [False, True])
def test_every_topic_has_its_own_count(tmp_path: Path, by_name: bool) -> None:  # noqa: FBT001
    """Topics that differ in name and count only keep them; a name given twice counts as last."""
    topics = [(f'/part_{i}/state', i) for i in range(40)]
    found = said(tmp_path, text_of([*topics, ('/part_3/state', 77)], by_name=by_name))
    files = ('a_0.mcap', 'a_1.mcap')
    counts = {**dict(topics), '/part_3/state': 77}
    assert found == Metadata(files, sum(range(40)) + 77, counts)


WRONG = {
    'name: /b\n': ('name: "/b\n', 'name: [/b\n', 'nam: /b\n', 'name: /b: 3\n', 'name: /é\n'),
    'message_count: 2\n': ('message_count: two\n', 'message_count: 010\n', 'message_count:\n'),
    '  topics_with_message_count:\n': ('   topics_with_message_count:\n', '  topics:\n'),
    '  relative_file_paths:\n': ('\n  relative_file_paths:\n', '   - x: 1\n', '...\n', 'é:\n'),
}


@pytest.mark.parametrize('by_name', [False, True])
@pytest.mark.parametrize(
    ('right', 'wrong'), [(right, wrong) for right, found in WRONG.items() for wrong in found]
)
def test_what_is_unusual_is_what_yaml_says(
    tmp_path: Path,
    right: str,
    wrong: str,
    by_name: bool,  # noqa: FBT001
) -> None:
    """An odd or broken entry among those alike is read, or refused, as in YAML."""
    text = text_of([('/a', 1), ('/b', 2), ('/c', 3), ('/d', 4)], by_name=by_name)
    assert right in text
    text = text.replace(right, wrong)
    assert said(tmp_path, text) == by_yaml(text)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    place=st.integers(0, 2000),
    gone=st.integers(0, 12),
    put=st.text('\n :-a0"\'#&*[]{}\t\x00é', max_size=4),
    by_name=st.booleans(),
)
def test_damage_anywhere_is_what_yaml_says(
    tmp_path: Path, place: int, gone: int, put: str, *, by_name: bool
) -> None:
    """A text that is changed anywhere is read, or refused, as in YAML."""
    text = text_of([(f'/part_{i}', i) for i in range(5)], by_name=by_name)
    at = place % len(text)
    text = text[:at] + put + text[at + gone :]
    assert said(tmp_path, text) == by_yaml(text)
