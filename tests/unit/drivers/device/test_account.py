"""What a wire counted of late."""

from palpate.drivers.device import Account, listed

MS = 1_000_000


def test_what_was_counted_after_a_moment_is_told_and_what_was_before_is_not() -> None:
    account = Account()
    account.note(100 * MS, {"lost": 2, "cut short": 0})
    account.note(300 * MS, {"lost": 2, "cut short": 1})
    account.note(400 * MS, {"lost": 5, "cut short": 1})
    account.note(500 * MS, {"lost": 5, "cut short": 1})
    assert account.since(0) == {"lost": 5, "cut short": 1}
    assert account.since(300 * MS) == {"lost": 3}
    assert account.since(400 * MS) == {}
    assert listed(account.since(100 * MS)) == "lost (3), cut short (1)"


def test_the_last_second_is_kept_and_no_more_than_it_needs() -> None:
    account = Account()
    for ms in range(0, 5000, 10):
        account.note(ms * MS, {"lost": ms // 10 + 1})
    assert account.lately(5000 * MS) == {"lost": 99}
    assert len(account._marks) == 101
    assert account.lately(9000 * MS) == {}
