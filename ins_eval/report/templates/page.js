"use strict";
(() => {
  const all = document.querySelectorAll("details");
  const open = (value) => all.forEach((one) => { one.open = value; });
  const bar = document.getElementById("tools");
  if (bar && all.length) {
    bar.hidden = false;
    bar.querySelector("[data-open]").addEventListener("click", () => open(true));
    bar.querySelector("[data-close]").addEventListener("click", () => open(false));
  }
  const reveal = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const around = target && (target.closest("details") || target.querySelector("details"));
    if (around) { around.open = true; target.scrollIntoView(); }
  };
  addEventListener("hashchange", reveal);
  reveal();
  let before = [];
  addEventListener("beforeprint", () => { before = [...all].map((one) => one.open); open(true); });
  addEventListener("afterprint", () => all.forEach((one, k) => { one.open = before[k]; }));

  document.querySelectorAll("table[data-long]").forEach((table) => {
    const field = document.createElement("input");
    field.type = "search";
    field.placeholder = "filter rows";
    field.setAttribute("aria-label", "Filter the rows of this table");
    field.className = "filter";
    table.parentElement.before(field);
    const rows = [...table.tBodies[0].rows];
    const size = (cell) => parseFloat(cell.textContent.replace("−", "-"));
    const compare = (a, b) => size(a) - size(b) || isNaN(size(a)) - isNaN(size(b)) || a.textContent.localeCompare(b.textContent);
    [...table.tHead.rows[0].cells].forEach((cell, column) => {
      if (!cell.textContent) return;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...cell.childNodes);
      cell.append(button);
      button.addEventListener("click", () => {
        const up = cell.ariaSort !== "ascending";
        [...cell.parentNode.cells].forEach((one) => { one.removeAttribute("aria-sort"); });
        cell.ariaSort = up ? "ascending" : "descending";
        const heads = rows.filter((row) => !row.classList.contains("remark"));
        const below = new Map(heads.map((row) => [row, rows[rows.indexOf(row) + 1]]));
        heads.sort((a, b) => (up ? 1 : -1) * compare(a.cells[column], b.cells[column])).forEach((row) => {
          table.tBodies[0].append(row);
          if (below.get(row)?.classList.contains("remark")) row.after(below.get(row));
        });
      });
    });
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = true;
      rows.forEach((row) => {
        if (!row.classList.contains("remark")) {
          shown = words.every((word) => row.textContent.toLowerCase().includes(word));
        }
        row.hidden = !shown;
      });
    });
  });
})();
