"""Who sent a command, from the identity that came with it and the publishers that ROS lists."""

import pytest

from ugv_acceptance import BadSample
from ugv_acceptance.monitoring.publisher_identity import Publisher
from ugv_acceptance.monitoring.senders import (
    BARE,
    BARE_WORDS,
    NAMELESS,
    Sender,
    check_operator,
    full_names,
    sender_of,
)

TELL, STRANGER = Publisher('/acceptance_tell', b'tell'), Publisher('/stranger', b'else')
UNNAMED = Publisher('/_NODE_NAME_UNKNOWN_', b'none', named=False)
OPERATORS = ('/acceptance_tell', '/acceptance_console')


def test_the_identity_of_a_message_tells_its_node() -> None:
    """However many publish: the one that has the identity sent it."""
    for comparable in (True, False):
        found = sender_of(b'else', [TELL, STRANGER], comparable=comparable)
        assert found == Sender(('/stranger',))


def test_without_an_identity_every_publisher_may_have_sent_it() -> None:
    """All are named, each once; a single one sent it."""
    again = Publisher('/stranger', b'more')
    found = sender_of(None, [STRANGER, TELL, again], comparable=True)
    assert found.words == 'one of /acceptance_tell, /stranger'
    assert sender_of(None, [TELL], comparable=True).words == '/acceptance_tell'


def test_an_identity_that_nobody_has_is_nobodys() -> None:
    """Where identities can be compared nobody listed sent it; elsewhere each of them may have."""
    found = sender_of(b'gone', [TELL, STRANGER], comparable=True)
    assert (found.nodes, found.settled) == ((NAMELESS,), False)
    found = sender_of(b'gone', [TELL, STRANGER], comparable=False)
    assert found == Sender(('/acceptance_tell', '/stranger'))


@pytest.mark.parametrize('gid', [None, b'none', b'gone'])
def test_a_name_that_is_not_told_yet_is_waited_for(gid: bytes | None) -> None:
    """Such a sender is not settled, and no operator as long as that lasts."""
    found = sender_of(gid, [UNNAMED], comparable=True)
    assert not found.settled
    with pytest.raises(BadSample, match=NAMELESS):
        check_operator(found, OPERATORS)


def test_no_publisher_at_all_tells_nothing() -> None:
    """A sender that is gone has no name."""
    assert sender_of(None, [], comparable=True).words == NAMELESS


def test_a_program_without_ros_is_told_as_one() -> None:
    """ROS has a placeholder for it, which nobody would understand."""
    bare = Publisher(f'{BARE}/{BARE}', b'bare')
    assert sender_of(b'bare', [bare], comparable=True).words == BARE_WORDS


def test_only_operators_may_command() -> None:
    """Every node that may have sent it has to be one; without `operators` everybody may."""
    check_operator(Sender(('/stranger',)), None)
    check_operator(Sender(('/acceptance_tell',)), OPERATORS)
    check_operator(Sender(('/acceptance_console', '/acceptance_tell')), OPERATORS)
    with pytest.raises(BadSample, match='sent by /stranger; only /acceptance_tell, /acceptance_c'):
        check_operator(Sender(('/stranger',)), OPERATORS)
    with pytest.raises(BadSample, match='one of /acceptance_tell, /stranger, and which is not kno'):
        check_operator(Sender(('/acceptance_tell', '/stranger')), OPERATORS)


@pytest.mark.parametrize(
    ('namespace', 'full'), [('/', '/acceptance_tell'), ('/robot1', '/robot1/acceptance_tell')]
)
def test_a_relative_name_is_in_the_monitors_namespace(namespace: str, full: str) -> None:
    """So one configuration serves robots in several namespaces; a full name stays."""
    assert full_names(['acceptance_tell', '/panel'], namespace) == (full, '/panel')
    assert full_names(None, namespace) is None
