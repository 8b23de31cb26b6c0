"""`simgap open` in a real browser: a record is dropped, corrected, diagnosed and its model taken away."""

import json

import pytest
from app.cart_record import write_cart
from app.commands import simgap

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")  # of playwright's own pipes
PATIENCE = 120_000  # ms, on a busy machine
DROP = """([name, text]) => {
  const dropped = new DataTransfer();
  dropped.items.add(new File([text], name));
  document.getElementById("drop").dispatchEvent(new DragEvent("drop", {dataTransfer: dropped, bubbles: true}));
}"""


@pytest.fixture
def tab(browser, served):
    """`tab()` opens the page in a tab; what it complains of, or asks of anybody else, fails the test."""
    complaints, contexts = [], []
    ours = served.address

    def open_tab(address: str = ours, **how):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **how})
        context.set_default_timeout(PATIENCE)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith((ours, "data:", "blob:")) else complaints.append(r.url))
        page.goto(address)
        return page

    yield open_tab
    for context in contexts:
        context.close()
    assert complaints == []


def choose(page, file) -> None:
    page.get_by_label("Choose files").set_input_files(file)
    page.locator("#plot .main-svg").first.wait_for()


def say(page, force: str, v: str, kind: str = "") -> None:
    page.get_by_label("What force is").select_option(label=force)
    page.get_by_label("What v is").select_option(label=v)
    if kind:
        page.get_by_label("Kind of v").select_option(kind)


def take(page, link: str, folder):
    with page.expect_download() as download:
        page.get_by_role("link", name=link, exact=True).click()
    file = folder / download.value.suggested_filename
    download.value.save_as(file)
    return file


@pytest.mark.slow
def test_a_dropped_record_is_corrected_and_diagnosed_and_its_model_simulates(tab, tmp_path):
    # Its heading says that v is an angle, which would make it a position.
    write_cart(tmp_path / "cart.csv", samples=400, heading="t,force [N],v [rad]")
    write_cart(tmp_path / "new.csv", samples=200, seed=1, heading="t,force [N],v [m/s]")
    page = tab()
    page.evaluate(DROP, ["cart.csv", (tmp_path / "cart.csv").read_text()])
    page.get_by_role("heading", name="cart.csv").wait_for()
    assert "400 samples, every 0.1 s by column t" in page.locator("main").inner_text()
    assert page.get_by_label("Kind of v").locator("option").first.inner_text() == "position (heading)"
    page.locator("#plot .main-svg").first.wait_for()
    say(page, "input", "output")
    page.get_by_label("Unit of v").fill("m/s")
    page.get_by_label("Kind of v").select_option("velocity")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Looking for a cause").first.wait_for()

    other = tab()  # while the first is at work
    choose(other, tmp_path / "new.csv")
    assert other.get_by_label("What v is").input_value() == "output"
    assert "200 samples" in other.locator("main").inner_text()

    page.get_by_role("link", name="Take the model away").wait_for()
    assert "because of Coulomb friction" in page.locator("h1").inner_text()
    page.locator(".js-plotly-plot .main-svg").first.wait_for()
    phone = tab(page.url, viewport={"width": 390, "height": 844}, is_mobile=True)
    phone.locator(".take summary").click()
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    phone.context.close()
    answer = json.loads(take(page, "JSON", tmp_path).read_text())
    assert [cause["effect"] for cause in answer["causes"]] == ["coulomb_friction"]
    friction = answer["causes"][0]["parameters"][0]
    assert friction["low"] < 0.6 < friction["high"]  # N, on 1 kg
    assert friction["unit"] == "m/s^2"

    model = take(page, "Take the model away", tmp_path)
    assert model.name == "cart.simgap"
    done = simgap("simulate", "cart.simgap", "new.csv", "--json", "run.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (run,) = json.loads((tmp_path / "run.json").read_text())["simulations"]
    assert run["metrics"]["v"]["rmse"] < 0.02  # the sensor noise is 0.01
    page.get_by_role("link", name="correct and diagnose again").click()
    assert page.get_by_label("Unit of v").input_value() == "m/s"  # what was said is still there


@pytest.mark.slow
def test_an_uneven_record_is_interpolated_where_that_is_asked_for(tab, tmp_path):
    write_cart(tmp_path / "cart.csv", samples=60)
    lines = (tmp_path / "cart.csv").read_text().splitlines()
    lines[30] = "2.93" + lines[30][lines[30].index(",") :]
    (tmp_path / "cart.csv").write_text("\n".join(lines))
    page = tab()
    choose(page, tmp_path / "cart.csv")
    say(page, "input", "output", "velocity")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Say the sampling time in seconds").wait_for()
    page.get_by_label("Interpolate onto an even grid of").fill("0.1")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_role("link", name="Take the model away").wait_for()


def test_a_bad_cell_gets_the_sentence_of_the_command_line(tab, tmp_path):
    write_cart(tmp_path / "bad.csv", samples=50)
    lines = (tmp_path / "bad.csv").read_text().splitlines()
    lines[4] = "0.3,1,oops"
    (tmp_path / "bad.csv").write_text("\n".join(lines))
    done = simgap("data", "check", "bad.csv", "--input", "force", "--output", "v", cwd=tmp_path)
    assert done.returncode == 2
    sentence = done.stderr.removeprefix("simgap: ").strip()
    page = tab()
    choose(page, tmp_path / "bad.csv")
    assert f"cannot be used: {sentence}" in page.locator("tbody").inner_text()
    page.get_by_role("button", name="Diagnose").click()
    assert "at least one of each" in page.get_by_role("alert").inner_text()
    (tmp_path / "empty.csv").write_text("")
    sentence = simgap("data", "check", "empty.csv", cwd=tmp_path).stderr.removeprefix("simgap: ").strip()
    page = tab()
    page.get_by_label("Choose files").set_input_files(tmp_path / "empty.csv")
    assert page.get_by_role("alert").inner_text() == sentence


def test_with_the_keyboard_alone_a_diagnosis_is_begun_and_stopped(tab, tmp_path):
    write_cart(tmp_path / "cart.csv")
    page = tab()
    page.on("filechooser", lambda chooser: chooser.set_files(tmp_path / "cart.csv"))
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.locator("#file:focus").wait_for(state="attached")
    page.keyboard.press("Enter")
    page.locator("#plot .main-svg").first.wait_for()
    for keys in (["Tab", "Tab", "i"], ["Tab", "Tab", "o"], ["Tab", "Tab", "v"], ["Enter"]):
        for key in keys:
            page.keyboard.press(key)
    assert page.get_by_label("What force is").input_value() == "input"
    assert page.get_by_label("What v is").input_value() == "output"
    assert page.get_by_label("Kind of v").input_value() == "velocity"
    page.get_by_role("button", name="Diagnose").press("Enter")
    page.get_by_role("button", name="Stop", disabled=False).press("Enter")
    page.get_by_role("heading", name="No diagnosis of cart.csv").wait_for()
    assert "Stopped" in page.get_by_role("alert").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_page_is_wider_than_a_phone(tab, tmp_path, scheme):
    write_cart(tmp_path / "a_rather_long_name_of_a_record_without_any_blank_in_it.csv", samples=50)
    page = tab(viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    choose(page, tmp_path / "a_rather_long_name_of_a_record_without_any_blank_in_it.csv")
    page.locator("#plot .main-svg").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.slow
def test_two_tabs_diagnose_at_once_and_each_gets_its_own_answer(tab, tmp_path):
    write_cart(tmp_path / "cart.csv")
    lines = (tmp_path / "cart.csv").read_text().splitlines()
    swapped = [",".join((t, v, force)) for t, force, v in (line.split(",") for line in lines)]
    (tmp_path / "swapped.csv").write_text("\n".join(swapped))
    pages = [tab(), tab()]
    for page, name in zip(pages, ("cart.csv", "swapped.csv"), strict=True):
        choose(page, tmp_path / name)
        say(page, "input", "output", "velocity" if name == "cart.csv" else "other")
        page.get_by_role("button", name="Diagnose").click()
    for page, name in zip(pages, ("cart", "swapped"), strict=True):
        page.get_by_role("link", name="Take the model away").wait_for()
        assert page.title() == f"Diagnosis of {name}"
    assert "Coulomb friction" in pages[0].locator("h1").inner_text()


@pytest.mark.slow
def test_several_files_are_logs_of_one_machine(tab, tmp_path):
    for k in range(3):
        write_cart(tmp_path / f"run{k}.csv", samples=300, seed=k)
    page = tab()
    choose(page, [tmp_path / f"run{k}.csv" for k in range(3)])
    assert "900 samples" in page.locator("h1 + p").inner_text()
    assert "3 logs; shown is run0.csv" in page.locator("h1 + p").inner_text()
    say(page, "input", "output", "velocity")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_role("link", name="Take the model away").wait_for()
    assert "Coulomb friction" in page.locator("h1").inner_text()


@pytest.mark.slow
def test_a_folder_of_experiments_is_diagnosed_as_its_description_says(tab, tmp_path):
    from simgap.data import save
    from simgap.data.simulated.rigs import hide

    save(hide("cart", {"coulomb_friction": 0.5}), tmp_path / "carts")
    page = tab()
    page.get_by_label("Choose a folder").set_input_files(tmp_path / "carts")
    page.get_by_role("heading", name="carts").wait_for()
    assert page.get_by_label("What v is").is_disabled()
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_role("link", name="Take the model away").wait_for()
    assert "Coulomb friction" in page.locator("h1").inner_text()
