"""Who may talk to the server."""

import os

import pytest

from tomoskin.core import DataError
from tomoskin.server.access import AccessPolicy, answer_headers, is_loopback, load_token


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8765", "localhost:8765", "LOCALHOST:8765", "[::1]:8765"]
)
def test_own_names_are_known(host):
    assert AccessPolicy(8765).admits_host(host)


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
    assert not AccessPolicy(8765).admits_host(host)


def test_the_default_port_of_http_may_be_left_out():
    assert AccessPolicy(80).admits_host("localhost")


def test_a_host_given_explicitly_is_known():
    policy = AccessPolicy(8765, "skin.lab.example")
    assert policy.admits_host("skin.lab.example:8765")
    assert policy.admits_host("127.0.0.1:8765")
    assert not policy.admits_host("other.lab.example:8765")


def test_on_every_address_only_literal_addresses_are_known():
    policy = AccessPolicy(8765, "0.0.0.0")
    assert policy.admits_host("192.168.1.7:8765")
    assert policy.admits_host("[fe80::1]:8765")
    assert not policy.admits_host("rebound.example:8765")
    assert not policy.admits_host("[fe80::1%a; script-src *]:8765")


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
    assert AccessPolicy(8765).admits_origin(origin, "127.0.0.1:8765") is known


def test_token_in_query_and_cookie():
    policy = AccessPolicy(8765)
    assert policy.has_token(f"token={policy.token}")
    assert policy.has_cookie(f"a=b; tomoskin-8765={policy.token}; c=d")
    for wrong in (
        "",
        "token=",
        "token=x",
        f"token={policy.token}&token=x",
        f"Token={policy.token}",
    ):
        assert not policy.has_token(wrong)
    for wrong in ("", "tomoskin-8765=", "tomoskin-8765=é", f"tomoskin-1={policy.token}", ";;;=,"):
        assert not policy.has_cookie(wrong)


def test_tokens_are_long_different_and_not_in_the_repr():
    one, two = AccessPolicy(8765), AccessPolicy(8765)
    assert one.token != two.token
    assert len(one.token) >= 32
    assert one.token not in repr(one)


def test_the_address_for_the_person():
    assert AccessPolicy(1, "0.0.0.0", token="T").address == "http://127.0.0.1:1/?token=T"
    assert AccessPolicy(1, "::1", token="T").address == "http://[::1]:1/?token=T"
    assert AccessPolicy(1, "lab", token="T").address == "http://lab:1/?token=T"


def test_cookie_is_out_of_reach():
    cookie = AccessPolicy(8765, token="T").set_cookie()
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


# a token that outlives its server


def test_a_token_is_kept_and_for_its_owner_alone(tmp_path):
    path = tmp_path / "token"
    token = load_token(path)
    assert load_token(path) == token
    assert len(token) >= 32
    assert path.stat().st_mode & 0o777 == 0o600
    assert AccessPolicy(1, token=token).has_token(f"token={token}")
    assert load_token(tmp_path / "other") != token


def test_a_token_file_that_others_can_read_or_that_holds_no_token_is_refused(tmp_path):
    path = tmp_path / "token"
    load_token(path)
    if os.name == "posix":
        path.chmod(0o644)
        with pytest.raises(DataError, match="other users of this machine can read"):
            load_token(path)
        path.chmod(0o600)
    for text in ("short", "a b" * 20, "é" * 40, ""):
        path.write_text(text)
        with pytest.raises(DataError):
            load_token(path)
    with pytest.raises(DataError, match="cannot be created"):
        load_token(tmp_path / "none" / "token")
