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

  document.querySelectorAll(".wide").forEach((frame) => {
    const svg = frame.querySelector("svg");
    const whole = svg.getAttribute("viewBox").split(" ").map(Number);
    let [x, y, width, height] = whole;
    let held = null;
    const show = () => {
      x = Math.min(Math.max(x, whole[0]), whole[0] + whole[2] - width);
      y = Math.min(Math.max(y, whole[1]), whole[1] + whole[3] - height);
      svg.setAttribute("viewBox", [x, y, width, height].join(" "));
      frame.classList.toggle("zoomed", width < whole[2]);
    };
    const zoom = (times, across = 0.5, down = 0.5) => {
      const wanted = Math.min(Math.max(width / times, whole[2] / 30), whole[2]);
      x += across * (width - wanted);
      y += down * (height - wanted * whole[3] / whole[2]);
      width = wanted;
      height = wanted * whole[3] / whole[2];
      show();
    };
    const move = (across, down) => { x += across * width; y += down * height; show(); };
    const at = (event) => {
      const box = svg.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    };
    const keys = {
      "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": () => zoom(0),
      ArrowLeft: () => move(-0.2, 0), ArrowRight: () => move(0.2, 0),
      ArrowUp: () => move(0, -0.2), ArrowDown: () => move(0, 0.2),
    };
    frame.addEventListener("keydown", (event) => {
      const arrow = event.key.startsWith("Arrow");
      if (!(event.key in keys) || event.ctrlKey || event.metaKey || (arrow && width === whole[2])) return;
      event.preventDefault();
      keys[event.key]();
    });
    svg.addEventListener("dblclick", (event) => { event.preventDefault(); zoom(event.shiftKey ? 0.5 : 2, ...at(event)); });
    svg.addEventListener("pointerdown", (event) => { if (width < whole[2]) held = at(event); });
    addEventListener("pointerup", () => { held = null; });
    svg.addEventListener("pointermove", (event) => {
      if (!held) return;
      const here = at(event);
      move(held[0] - here[0], held[1] - here[1]);
      held = here;
    });
    addEventListener("beforeprint", () => zoom(0));
  });

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
