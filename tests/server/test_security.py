"""Who may talk to the server."""

import pytest

from tomoskin.server.security import Door, answer_headers, is_loopback


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8765", "localhost:8765", "LOCALHOST:8765", "[::1]:8765"]
)
def test_own_names_are_known(host):
    assert Door(8765).knows_host(host)


@pytest.mark.parametrize(
    "host",
    [
        "",
        "127.0.0.1",
        "127.0.0.1:80",
        "127.0.0.1:8766",
        "evil.example:8765",
        "127.0.0.1.evil.example:8765",
        "localhost:8765@evil.example",
        "192.168.1.7:8765",
        "localhost:" + "9" * 5000,
        "[::1",
        "::1:8765",
    ],
)
def test_strange_names_are_not(host):
    assert not Door(8765).knows_host(host)


def test_the_default_port_of_http_may_be_left_out():
    assert Door(80).knows_host("localhost")


def test_a_host_given_explicitly_is_known():
    door = Door(8765, "skin.lab.example")
    assert door.knows_host("skin.lab.example:8765")
    assert door.knows_host("127.0.0.1:8765")
    assert not door.knows_host("other.lab.example:8765")


def test_on_every_address_only_literal_addresses_are_known():
    door = Door(8765, "0.0.0.0")
    assert door.knows_host("192.168.1.7:8765")
    assert door.knows_host("[fe80::1]:8765")
    assert not door.knows_host("rebound.example:8765")
    assert not door.knows_host("[fe80::1%a; script-src *]:8765")


@pytest.mark.parametrize(
    ("origin", "known"),
    [
        ("http://127.0.0.1:8765", True),
        (None, True),
        ("null", False),
        ("http://localhost:8765", False),
        ("http://evil.example", False),
        ("https://127.0.0.1:8765", False),
        ("http://127.0.0.1:9999", False),
    ],
)
def test_origin_must_be_the_host(origin, known):
    assert Door(8765).knows_origin(origin, "127.0.0.1:8765") is known


def test_token_in_query_and_cookie():
    door = Door(8765)
    assert door.has_token(f"token={door.token}")
    assert door.has_cookie(f"a=b; tomoskin-8765={door.token}; c=d")
    for wrong in ("", "token=", "token=x", f"token={door.token}&token=x", f"Token={door.token}"):
        assert not door.has_token(wrong)
    for wrong in ("", "tomoskin-8765=", "tomoskin-8765=é", f"tomoskin-1={door.token}", ";;;=,"):
        assert not door.has_cookie(wrong)


def test_tokens_are_long_different_and_not_in_the_repr():
    one, two = Door(8765), Door(8765)
    assert one.token != two.token
    assert len(one.token) >= 32
    assert one.token not in repr(one)


def test_the_address_for_the_person():
    assert Door(1, "0.0.0.0", token="T").address == "http://127.0.0.1:1/?token=T"
    assert Door(1, "::1", token="T").address == "http://[::1]:1/?token=T"
    assert Door(1, "lab", token="T").address == "http://lab:1/?token=T"


def test_cookie_is_out_of_reach():
    cookie = Door(8765, token="T").set_cookie()
    assert cookie == "tomoskin-8765=T; Path=/; HttpOnly; SameSite=Strict"


def test_policy_has_no_inline_script():
    policy = answer_headers("127.0.0.1:8765")["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "unsafe" not in policy
    assert "ws://127.0.0.1:8765" in policy


def test_loopback():
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("192.168.1.7")
    assert not is_loopback("skin.lab.example")
