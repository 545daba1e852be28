"use strict";
(() => {
  const NEAR = 30, MOST = 30;  // of a drawing: from the pointer to a curve; how much nearer a zoom goes
  const digits = (step) => Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 12);
  const number = (value, step) => (+value.toFixed(digits(step)) || 0).toFixed(digits(step)).replace("-", "−");

  // One axis: from values to places in the drawing and back, and a value in words with its unit.
  const axis = (range, label, start, length) => {
    const [low, high, kind] = range.split(" ");
    const log = kind === "log";
    const [ahead, back] = log ? [Math.log10, (v) => 10 ** v] : [(v) => v, (v) => v];
    const from = ahead(+low), span = ahead(+high) - from;
    const [, name, unit] = label.match(/^(.*?)(?: ?\[([^\]]*)\])?$/);
    const value = (place) => back(from + span * (place - start) / length);
    const words = (place) => {
      if (kind === "names") return "";
      const v = value(place);
      const shown = log ? String(+v.toPrecision(3)) : number(v, Math.abs(span) / 100);
      return unit && unit !== "1" ? `${shown} ${unit}` : `${name} ${shown}`.trim();
    };
    return { low: +low, high: +high, log, label, value, words, place: (v) => start + length * (ahead(v) - from) / span };
  };

  // One panel: its curves as places in the drawing, and what its zoom along x, place -> k place + t, moves.
  const panel = (group) => {
    const [left, top, width, height] = group.dataset.box.split(" ").map(Number);
    const x = axis(group.dataset.x, group.dataset.xLabel, left, width);
    const y = axis(group.dataset.y, group.dataset.yLabel, top + height, -height);
    const curves = [...group.querySelectorAll("[data-name]")].map((curve) => ({
      name: curve.dataset.name,
      points: [...curve.querySelectorAll("path[clip-path]")].flatMap((path) =>
        [...path.getAttribute("d").matchAll(/([ML]) (\S+) (\S+)/g)].map(([, how, px, py]) => [+px, +py, how === "L"]),
      ).concat([...curve.querySelectorAll("use")].map((mark) => [+mark.getAttribute("x"), +mark.getAttribute("y"), false])),
    }));
    const drawn = [...group.querySelectorAll("path[clip-path], [clip-path] use, [id*=PolyCollection] defs path")]
      .filter((one) => !one.closest("[id*='matplotlib.axis']") && !(one.matches("use") && one.closest("[id*=PolyCollection]")))
      .map((one) => [one, one.matches("use") ? "x" : "d"])
      .map(([one, what]) => ({ one, what, was: one.getAttribute(what) }));
    const ticks = [...group.querySelectorAll("[id*=xtick_]")];
    const notes = [...group.querySelectorAll("[data-at]")];
    const self = { left, top, width, height, x, y, curves, k: 1, t: 0 };
    self.inside = ([px, py]) => px >= left - 5 && px <= left + width + 5 && py >= top - 5 && py <= top + height + 5;
    self.value = (px) => x.value((px - self.t) / self.k);
    const mark = (v) => {
      const made = ticks[0].cloneNode(true), text = made.querySelector("text");
      [made, ...made.querySelectorAll("[id]")].forEach((one) => one.removeAttribute("id"));
      made.setAttribute("class", "made");
      made.style.display = "";
      made.setAttribute("transform", `translate(${self.k * x.place(v) + self.t - ticks[0].querySelector("use").getAttribute("x")} 0)`);
      ticks[0].parentNode.append(made);
      return text;
    };
    self.show = (low, high) => {
      const [a, b] = [Math.max(low, x.low), Math.min(high, x.high)];
      const whole = !(b > a) || b - a > 0.999 * (x.high - x.low);
      self.k = whole ? 1 : (x.high - x.low) / (b - a);
      self.t = whole ? 0 : left - self.k * x.place(a);
      const moved = (place) => (self.k * place + self.t).toFixed(2);
      drawn.forEach(({ one, what, was }) => {
        one.setAttribute(what, whole ? was : what === "x" ? moved(was) : was.replace(/([ML]) (\S+)/g, (_, how, px) => `${how} ${moved(px)}`));
      });
      notes.forEach((one) => {
        const place = x.place(one.dataset.at), here = self.k * place + self.t;
        one.setAttribute("transform", `translate(${here - place} 0)`);
        one.style.display = here < left || here > left + width ? "none" : "";
      });
      group.querySelectorAll(".made").forEach((one) => one.remove());
      ticks.forEach((one) => { one.style.display = whole ? "" : "none"; });
      if (whole || !ticks.length) return;
      const rough = (b - a) / 6, ten = 10 ** Math.floor(Math.log10(rough));
      const step = [1, 2, 5, 10].map((one) => one * ten).find((one) => one >= rough);
      for (let n = Math.ceil(a / step); n * step <= b; n += 1) {
        const text = mark(n * step);
        if (text) text.textContent = number(n * step, step);
      }
    };
    return self;
  };

  // The point of a curve that is nearest to a place in the drawing: [distance, x, y].
  const nearest = (of, points, [px, py]) => {
    let best = [Infinity];
    points.forEach(([cx, cy, joined], n) => {
      let [ax, ay] = [of.k * cx + of.t, cy];
      if (joined) {
        const [bx, by] = [of.k * points[n - 1][0] + of.t, points[n - 1][1]];
        const length = (bx - ax) ** 2 + (by - ay) ** 2;
        const part = length ? Math.min(Math.max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length, 0), 1) : 0;
        [ax, ay] = [ax + part * (bx - ax), ay + part * (by - ay)];
      }
      const far = Math.hypot(ax - px, ay - py);
      if (far < best[0] && of.inside([ax, ay])) best = [far, ax, ay];
    });
    return best;
  };

  // Figures whose panels all lie on one axis of time zoom along it, and all such figures of a page together.
  const shared = new Map();
  const along = (label, panels) => {
    if (!shared.has(label)) shared.set(label, { low: Infinity, high: -Infinity, all: [] });
    const time = shared.get(label);
    time.low = Math.min(time.low, ...panels.map((one) => one.x.low));
    time.high = Math.max(time.high, ...panels.map((one) => one.x.high));
    let [first] = panels;
    const span = () => time.now[1] - time.now[0];
    const set = (low, width) => {
      const from = Math.min(Math.max(low, time.low), time.high - width);
      time.now = [from, from + width];
      time.all.forEach((one) => one(...time.now));
    };
    time.now = [time.low, time.high];
    return {
      time,
      draw: (frame) => time.all.push((low, high) => {
        panels.forEach((one) => one.show(low, high));
        frame.classList.toggle("zoomed", span() < 0.999 * (time.high - time.low));
      }),
      zoom: (times, place) => {
        const at = place ? first.value(place[0]) : (time.now[0] + time.now[1]) / 2;
        const width = Math.min(Math.max(span() / times, (time.high - time.low) / MOST), time.high - time.low);
        set(at - (at - time.now[0]) * width / span(), width);
      },
      move: (across) => set(time.now[0] + across / first.width * span(), span()),
      step: () => [0.2 * first.width, 0],
    };
  };

  // Every other figure is magnified.
  const magnified = (svg) => {
    const whole = svg.getAttribute("viewBox").split(" ").map(Number);
    let [x, y, width, height] = whole, framed = null;
    const show = () => {
      x = Math.min(Math.max(x, whole[0]), whole[0] + whole[2] - width);
      y = Math.min(Math.max(y, whole[1]), whole[1] + whole[3] - height);
      svg.setAttribute("viewBox", [x, y, width, height].join(" "));
      framed.classList.toggle("zoomed", width < whole[2]);
    };
    return {
      draw: (frame) => { framed = frame; },
      zoom: (times, place = [x + width / 2, y + height / 2]) => {
        const wanted = Math.min(Math.max(width / times, whole[2] / MOST), whole[2]);
        x = place[0] - (place[0] - x) * wanted / width;
        y = place[1] - (place[1] - y) * wanted / width;
        [width, height] = [wanted, wanted * whole[3] / whole[2]];
        show();
      },
      move: (across, down) => { x += across; y += down; show(); },
      step: () => [0.2 * width, 0.2 * height],
    };
  };

  document.querySelectorAll(".wide").forEach((frame) => {
    const svg = frame.querySelector("svg"), reading = frame.querySelector("output");
    const panels = [...svg.querySelectorAll("[data-box]")].map(panel);
    const curves = panels.flatMap((of) => of.curves.map((curve) => ({ of, ...curve }))).filter((one) => one.points.length);
    const labels = new Set(panels.map(({ x }) => (x.log ? "" : x.label)));
    const [label] = labels;
    const view = labels.size === 1 && label.startsWith("time") ? along(label, panels) : magnified(svg);
    view.draw(frame);
    const dot = document.createElementNS(svg.namespaceURI, "circle");
    dot.setAttribute("r", 3);
    dot.setAttribute("class", "read");

    const read = (curve, px, py) => {
      const { of, name } = curve, { left, top } = frame.getBoundingClientRect();
      reading.textContent = `${name}: ${[of.x.words((px - of.t) / of.k), of.y.words(py)].filter(Boolean).join(", ")}`;
      dot.setAttribute("cx", px);
      dot.setAttribute("cy", py);
      svg.append(dot);
      const at = new DOMPoint(px, py).matrixTransform(svg.getScreenCTM());
      const room = frame.clientWidth - reading.offsetWidth;
      reading.style.left = `${Math.max(0, Math.min(at.x - left + 10, room)) + frame.scrollLeft}px`;
      reading.style.top = `${Math.max(0, at.y - top - reading.offsetHeight - 10)}px`;
    };
    const leave = () => { reading.textContent = ""; dot.remove(); };
    const at = (event) => {
      const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [x, y];
    };
    const hover = (place) => {
      const found = curves.filter(({ of }) => of.inside(place))
        .map((curve) => [curve, ...nearest(curve.of, curve.points, place)])
        .reduce((best, one) => (one[1] < best[1] ? one : best), [null, NEAR]);
      if (found[0]) read(found[0], found[2], found[3]);
      else leave();
    };

    let which = 0, where = -1;
    const walk = (across, down) => {
      if (!curves.length) return;
      which = (which + down + curves.length) % curves.length;
      const curve = curves[which], shown = curve.points.map(([px, py]) => [curve.of.k * px + curve.of.t, py]).filter(curve.of.inside);
      if (!shown.length) { leave(); return; }
      const one = 1 / Math.max(Math.min(50, shown.length - 1), 1);
      where = where < 0 ? 0 : Math.min(Math.max(where + across * one, 0), 1);
      read(curve, ...shown[Math.round(where * (shown.length - 1))]);
    };

    const go = (across, down) => { const [dx, dy] = view.step(); view.move(across * dx, down * dy); };
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const keys = { "+": 1.5, "=": 1.5, "-": 1 / 1.5, "0": 0 };
    frame.addEventListener("keydown", (event) => {
      const arrow = arrows[event.key];
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (arrow && !event.shiftKey && !frame.classList.contains("zoomed")) return;
      if (event.key in keys) { leave(); view.zoom(keys[event.key]); }
      else if (event.key === "Escape") leave();
      else if (!arrow) return;
      else if (event.shiftKey) walk(...arrow);
      else { leave(); go(...arrow); }
      event.preventDefault();
    });
    frame.addEventListener("blur", leave);

    const bar = document.createElement("p");
    bar.className = "zoom";
    [["+", 1.5, "Zoom in"], ["−", 1 / 1.5, "Zoom out"], ["all", 0, "Show all"]].forEach(([text, times, label]) => {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: text, title: label, ariaLabel: label });
      button.addEventListener("click", () => { leave(); view.zoom(times); });
      bar.append(button);
    });
    frame.before(bar);

    let held = null;
    svg.addEventListener("dblclick", (event) => {
      event.preventDefault();
      leave();
      view.zoom(event.shiftKey ? 0.5 : 2, at(event));
    });
    svg.addEventListener("pointerdown", (event) => {
      if (frame.classList.contains("zoomed")) held = at(event);
      else hover(at(event));  // a finger does not hover
    });
    addEventListener("pointerup", () => { held = null; });
    svg.addEventListener("pointermove", (event) => {
      if (!held) { hover(at(event)); return; }
      leave();
      const here = at(event);
      view.move(held[0] - here[0], held[1] - here[1]);
      held = at(event);
    });
    svg.addEventListener("pointerleave", (event) => { if (event.pointerType !== "touch") leave(); });
    addEventListener("beforeprint", () => { leave(); view.zoom(0); });
  });
})();
