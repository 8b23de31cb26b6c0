import io

from rich.console import Console

from simgap.reports.rendering import escape, to_markdown, to_rich
from simgap.reports.tables import Cell, Table, dataset_table

MARKDOWN = r"""### tanks

| model | status | RMSE level first \[V\] | RMSE level second \[V\] | fit % | level 1/10/50 ahead \[V\] | parameters | fit s |
|---|---|--:|--:|--:|--:|--:|--:|
| arx | ok | **1** | **0.5** | **60.5** | 0.1/0.5/0.9 | 4 | 0.25 |
| mean | ok | 2 | 2 | 0.0 |  | 1 | 0.001 |
| gru | error \[1\] | - | - | - |  |  |  |

\[1\] error: fit raised MemoryError: \[x\] (gru.py, line 3)
"""  # noqa: E501

TERMINAL = """\
tanks

                    RMSE    RMSE
                   level   level              level
                   first  second   fit      1/10/50
 model  status       [V]     [V]     %    ahead [V]  parameters  fit s
 ─────────────────────────────────────────────────────────────────────
 arx    ok             1     0.5  60.5  0.1/0.5/0.9           4   0.25
 mean   ok             2       2   0.0                        1  0.001
 gru    error [1]      -       -     -

[1] error: fit raised MemoryError: [x] (gru.py, line 3)

"""


def drawn(table: Table, width: int = 120) -> str:
    console = Console(file=io.StringIO(), width=width, color_system=None)
    console.print(to_rich(table, width))
    return console.file.getvalue()


def test_a_small_table_renders_as_this_markdown(results):
    assert to_markdown(dataset_table(results, "tanks"), level=3) == MARKDOWN


def test_a_small_table_renders_as_this_text(results):
    lines = [line.rstrip() for line in drawn(dataset_table(results, "tanks"), width=80).splitlines()]
    assert "\n".join(lines) + "\n" == TERMINAL


def test_columns_that_do_not_fit_a_narrow_terminal_are_left_out_and_named(results):
    text = drawn(dataset_table(results, "tanks"), width=60)
    assert "Not shown on this narrow terminal: parameters, fit s" in text
    assert "0.1/0.5/0.9" in text
    assert "…" not in text


def test_names_from_data_sets_are_shown_and_not_obeyed():
    evil = "[red]|<script>\x1b[31m`*_#\n## title"
    table = Table(evil, ["model", evil], [[Cell(evil), Cell(evil, best=True)]], [evil])
    text = to_markdown(table)
    assert "<script>" not in text
    assert "\x1b" not in text + drawn(table)
    assert "[red]" in drawn(table)
    assert all(line.count("|") - line.count("\\|") == 3 for line in text.splitlines() if line.startswith("|"))
    assert "\n## title" not in text


def test_escaped_text_is_one_line():
    assert escape("a\nb|c_d <e> [f](g)") == r"a b\|c\_d &lt;e&gt; \[f\](g)"
