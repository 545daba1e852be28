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
