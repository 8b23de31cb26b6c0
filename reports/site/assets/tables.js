"use strict";
// Sorting and filtering of the tables. Without this file they are plain tables in the order of the leaderboard.
(() => {
  const number = (cell) => {
    const text = cell.dataset.value ?? cell.textContent.trim();
    const value = text === "inf" ? Infinity : text === "-inf" ? -Infinity : parseFloat(text);
    return Number.isNaN(value) ? null : value;
  };
  const words = new Intl.Collator("en", { numeric: true });

  function sort(table, column, descending) {
    const body = table.tBodies[0];
    const cell = (row) => row.cells[column];
    const rows = [...body.rows];
    const numeric = !table.tHead.rows[0].cells[column].classList.contains("words");
    const compare = (a, b) => {
      if (!numeric) return words.compare(cell(a).textContent, cell(b).textContent) * (descending ? -1 : 1);
      const [x, y] = [number(cell(a)), number(cell(b))];
      if (x === null || y === null) return (x === null) - (y === null); // what has no figure stands last, always
      return x === y ? 0 : (x < y ? -1 : 1) * (descending ? -1 : 1);
    };
    body.append(...rows.sort(compare));
  }

  function makeSortable(table) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      const link = head.querySelector("a");
      button.append(...[...(link ?? head).childNodes].map((node) => node.cloneNode()));
      if (link) {
        link.className = "of";
        link.setAttribute("aria-label", `page of ${link.textContent.trim()}`);
        link.textContent = "page";
      }
      head.replaceChildren(button, ...(link ? [link] : []));
      button.addEventListener("click", () => {
        const first = head.dataset.first ?? "ascending";
        const other = first === "ascending" ? "descending" : "ascending";
        const order = head.getAttribute("aria-sort") === first ? other : first;
        heads.forEach((one) => one.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", order);
        sort(table, column, order === "descending");
      });
    });
  }

  function makeFilter(form) {
    const table = document.getElementById(form.dataset.table);
    const status = form.querySelector("output");
    const apply = () => {
      const named = (name) => new Set([...form.querySelectorAll(`[name=${name}]:checked`)].map((box) => box.value));
      const [groups, columns] = [named("group"), named("column")];
      const text = form.querySelector("[type=search]").value.trim().toLowerCase();
      let shown = 0;
      for (const row of table.tBodies[0].rows) {
        row.hidden = !(groups.has(row.dataset.group) && row.cells[0].textContent.toLowerCase().includes(text));
        shown += !row.hidden;
      }
      for (const row of [table.tHead.rows[0], ...table.tBodies[0].rows]) {
        [...row.cells].slice(1).forEach((cell, i) => { cell.hidden = !columns.has(String(i + 1)); });
      }
      status.textContent = `${shown} of ${table.tBodies[0].rows.length} models, ${columns.size} data sets`;
    };
    form.addEventListener("input", apply);
    form.addEventListener("submit", (event) => event.preventDefault());
    form.hidden = false;
    form.querySelector("details").open = matchMedia("(min-width: 700px)").matches;
    apply();
  }

  document.querySelectorAll("table.sortable").forEach(makeSortable);
  document.querySelectorAll("form.filters").forEach(makeFilter);
})();
