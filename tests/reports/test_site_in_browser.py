"""The site in a real browser, from disk: it sorts, filters, overlays, opens a diagnosis, and asks nobody."""

import pytest

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")  # of playwright's own pipes


@pytest.fixture
def visit(browser, site):
    """`visit("index.html")` opens a page; what it complains of or asks a network for fails the test."""
    complaints, contexts = [], []

    def open_page(page: str, **how):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **how})
        contexts.append(context)
        opened = context.new_page()
        opened.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        opened.on("pageerror", lambda error: complaints.append(str(error)))
        opened.on(
            "request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else complaints.append(r.url)
        )
        opened.goto((site / page).as_uri())
        return opened

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


def wait_until(page, expression: str) -> None:
    """Ask until it is so; wait_for_function evaluates texts in the page, which its security policy forbids."""
    for _ in range(100):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"not so after 10 s: {expression}")


def first_column(page) -> list[str]:
    return [cell.inner_text() for cell in page.query_selector_all("#overview-1 tbody tr:not([hidden]) th")]


def test_a_click_on_a_heading_sorts_and_another_turns_the_order_round(visit):
    page = visit("index.html")
    assert sorted(first_column(page)) == ["arx", "hold", "mean"]
    page.get_by_role("button", name="model").click()
    assert first_column(page) == ["arx", "hold", "mean"]
    page.get_by_role("button", name="model").press("Enter")  # the keyboard will do
    assert first_column(page) == ["mean", "hold", "arx"]
    assert page.locator("#overview-1 th[aria-sort]").get_attribute("aria-sort") == "descending"
    page.get_by_role("button", name="gimbal_short").click()
    fits = [float(cell.get_attribute("data-value")) for cell in page.query_selector_all("#overview-1 tbody td")]
    assert fits == sorted(fits, reverse=True)
    page.get_by_role("button", name="gimbal_short").click()
    assert first_column(page)[-1] == "arx"


def test_filters_hide_models_and_data_sets_and_say_how_many_are_left(visit):
    page = visit("index.html")
    page.get_by_label("Name has").fill("AR")
    assert first_column(page) == ["arx"]
    assert "1 of 3 models" in page.locator("form output").inner_text()
    page.get_by_label("Name has").fill("")
    page.get_by_label("classical").uncheck()
    assert first_column(page) == []
    page.get_by_role("checkbox", name="gimbal_short").uncheck()
    assert not page.locator("#overview-1 thead th").nth(1).is_visible()


def test_models_are_overlaid_on_the_record_that_is_chosen(visit):
    page = visit("datasets/gimbal_short.html")
    page.locator(".records").scroll_into_view_if_needed()
    plot = page.locator(".records .plot")
    plot.locator(".main-svg").first.wait_for()
    names = "() => [...new Set(document.querySelector('.records .plot').data.map(trace => trace.name))]"
    assert set(page.evaluate(names)) == {"measured", "input", "arx", "hold"}
    page.get_by_label("mean").check()
    wait_until(page, f"({names})().includes('mean')")
    page.get_by_label("arx", exact=True).uncheck()
    wait_until(page, f"!({names})().includes('arx')")
    page.get_by_label("Test record").select_option(index=1)
    second = page.get_by_label("Test record").locator("option").nth(1).inner_text()
    wait_until(page, f"document.querySelector('.records .plot').ariaLabel.startsWith('Record {second}: measured')")
    low, high = page.evaluate("document.querySelector('.records .plot').layout.xaxis.range")
    page.get_by_role("button", name="Zoom in").click()
    zoomed = page.evaluate("document.querySelector('.records .plot').layout.xaxis.range")
    assert zoomed[1] - zoomed[0] == pytest.approx((high - low) / 2)


def test_a_model_page_draws_free_run_residual_tests_poles_and_gain(visit):
    page = visit("models/arx.html")
    titles = set()
    for _ in range(12):
        page.mouse.wheel(0, 600)
        page.wait_for_timeout(150)
        titles = set(page.evaluate(
            "[...document.querySelectorAll('figure .js-plotly-plot')].map(p => p.layout.title.text)"))  # fmt: skip
    assert {"Poles", "Gain", "Phase", "Error of phi with its own past"} <= titles
    assert page.locator(".records .main-svg").count() > 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_diagnosis_is_opened_from_the_list_and_draws_its_plots(visit, scheme):
    page = visit("index.html", color_scheme=scheme)
    page.get_by_role("link", name="Diagnoses").click()
    page.get_by_role("link", name="cart").first.click()
    assert "Coulomb friction" in page.locator("h1").inner_text()
    page.locator(".js-plotly-plot").first.wait_for()


@pytest.mark.parametrize("page", ["index.html", "datasets/gimbal_short.html", "models/arx.html", "recovery.html",
                                  "diagnoses/cart.html", "diagnoses/only_json.html", "published.html"])  # fmt: skip
def test_no_page_is_wider_than_a_phone(visit, page):
    opened = visit(page, viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True)
    assert opened.evaluate("document.documentElement.scrollWidth") <= 390


def test_without_scripts_all_tables_can_be_read(visit):
    page = visit("datasets/gimbal_short.html", java_script_enabled=False)
    assert page.get_by_role("table").count() == 3
    assert "need JavaScript" in page.locator("main").inner_text()
