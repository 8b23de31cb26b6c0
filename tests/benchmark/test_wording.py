from math import inf, nan

from simgap.wording import amount, number, percent


def test_numbers_have_three_digits_are_not_rounded_before_the_point_and_end_in_no_zero():
    values = (0.0, -0.0, 0.0012345, 0.6075, 2.5, 26.78, 99.97, 1234.5, -123456.7)
    assert [number(v) for v in values] == [
        "0", "0", "0.00123", "0.608", "2.5", "26.8", "100", "1234", "-123457",
    ]  # fmt: skip


def test_very_small_and_very_large_numbers_have_a_short_exponent():
    assert [number(v) for v in (1.234e-7, 2e-5, 1e6, 1234567.0, 1e100)] == [
        "1.23e-7",
        "2e-5",
        "1e6",
        "1.23457e6",
        "1e100",
    ]


def test_an_error_has_two_digits():
    assert [number(v, 2) for v in (0.7684, 0.0123, 99.7, 1234.5)] == ["0.77", "0.012", "100", "1234"]


def test_an_amount_that_is_no_number_diverges():
    assert [amount(v, "mm") for v in (0.8, inf, nan)] == ["0.8 mm", "diverges", "diverges"]
    assert amount(0.8, "") == "0.8"


def test_percents_show_what_lacks_to_everything():
    values = (0.0, 0.004, 0.613, 0.9968, 0.99995, 1 - 1e-12, 1.0, nan)
    assert [percent(v) for v in values] == [
        "0 %", "less than 1 %", "61 %", "99.7 %", "99.995 %", "100 %", "100 %", "an unknown share",
    ]  # fmt: skip
