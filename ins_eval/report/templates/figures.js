"use strict";
(() => {
  const NEAR = 30, MOST = 30;  // of a drawing: from the pointer to a curve; how much nearer a zoom goes
  const whole = d3.zoomIdentity;
  const signed = (format) => (value) => format(value).replace("-", "−");

  // One axis: its scale, from values to places in the drawing, and a value in words with its unit.
  const axis = (range, label, places) => {
    const [low, high, kind] = range.split(" ");
    const scale = (kind === "log" ? d3.scaleLog() : d3.scaleLinear()).domain([+low, +high]).range(places);
    const [, name, unit] = label.match(/^(.*?)(?: ?\[([^\]]*)\])?$/);
    const words = (place, shown = scale) => {
      if (kind === "names") return "";
      const value = shown.invert(place), [from, to] = shown.domain();
      const fixed = signed(d3.format(`.${d3.precisionFixed((to - from) / 100)}f`));
      const text = kind === "log" ? String(+value.toPrecision(3)) : fixed(value);
      return unit && unit !== "1" ? `${text} ${unit}` : `${name} ${text}`.trim();
    };
    return { scale, words, time: kind !== "log" && label.startsWith("time") && label };
  };

  // The transform that shows, of a scale, what lies in a span of it; of one that misses it, all.
  const fit = (scale, span) => {
    const [low, high] = scale.domain(), [left] = scale.range();
    const [from, to] = [Math.max(low, span[0]), Math.min(high, span[1])], k = (high - low) / (to - from);
    return k > 1.001 && k < Infinity ? whole.translate(left - k * scale(from), 0).scale(k) : whole;
  };

  // One panel: its curves as places in the drawing, and what a zoom along x moves.
  const panel = (group) => {
    const [left, top, width, height] = group.dataset.box.split(" ").map(Number);
    const x = axis(group.dataset.x, group.dataset.xLabel, [left, left + width]);
    const y = axis(group.dataset.y, group.dataset.yLabel, [top + height, top]);
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
    const ticks = d3.select(group).selectAll("[id*=xtick_]"), notes = d3.select(group).selectAll("[data-at]");
    const self = { x, curves, view: whole, area: [[left, top], [left + width, top + height]] };
    self.inside = ([px, py]) => px >= left - 5 && px <= left + width + 5 && py >= top - 5 && py <= top + height + 5;
    self.words = (px, py) => [x.words(px, self.view.rescaleX(x.scale)), y.words(py)].filter(Boolean).join(", ");
    self.show = (span) => {
      const view = self.view = fit(x.scale, span), shown = view.rescaleX(x.scale);
      const moved = (place) => view.applyX(place).toFixed(2);
      drawn.forEach(({ one, what, was }) => {
        const now = what === "x" ? moved(was) : was.replace(/([ML]) (\S+)/g, (_, how, px) => `${how} ${moved(px)}`);
        one.setAttribute(what, view === whole ? was : now);
      });
      notes.each(function () {
        const here = shown(this.dataset.at), out = here < left || here > left + width;
        d3.select(this).attr("transform", `translate(${here - x.scale(this.dataset.at)} 0)`).style("display", out ? "none" : null);
      });
      d3.select(group).selectAll(".made").remove();
      ticks.style("display", view === whole ? null : "none");
      if (view === whole || ticks.empty()) return;
      const first = ticks.node(), made = d3.select(first.parentNode).selectAll(".made").data(shown.ticks(6)).enter()
        .append(() => first.cloneNode(true)).attr("class", "made").attr("id", null).style("display", null)
        .attr("transform", (value) => `translate(${shown(value) - first.querySelector("use").getAttribute("x")} 0)`);
      made.select("text").text(signed(shown.tickFormat(6, "f")));
      made.selectAll("[id]").attr("id", null);
    };
    return self;
  };

  // The point of a curve that is nearest to a place in the drawing: [distance, x, y].
  const nearest = (of, points, [px, py]) => {
    let best = [Infinity];
    points.forEach(([cx, cy, joined], n) => {
      let [ax, ay] = [of.view.applyX(cx), cy];
      if (joined) {
        const [bx, by] = [of.view.applyX(points[n - 1][0]), points[n - 1][1]];
        const length = (bx - ax) ** 2 + (by - ay) ** 2;
        const part = length ? Math.min(Math.max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length, 0), 1) : 0;
        [ax, ay] = [ax + part * (bx - ax), ay + part * (by - ay)];
      }
      const far = Math.hypot(ax - px, ay - py);
      if (far < best[0] && of.inside([ax, ay])) best = [far, ax, ay];
    });
    return best;
  };

  const figures = [];
  let leading = false;  // the figure that is zoomed takes those over the same time along

  d3.selectAll(".wide").each(function () {
    const frame = this, svg = d3.select(frame).select("svg"), sheet = svg.select("g"), reading = frame.querySelector("output");
    const panels = svg.selectAll("[data-box]").nodes().map(panel), [first] = panels;
    const curves = panels.flatMap((of) => of.curves.map((curve) => ({ of, ...curve }))).filter((one) => one.points.length);
    const dot = sheet.append("circle").attr("r", 3).attr("class", "read").remove();
    const time = new Set(panels.map(({ x }) => x.time)).size === 1 && first.x.time;

    const read = ({ of, name }, px, py) => {
      const { left, top } = frame.getBoundingClientRect();
      reading.textContent = `${name}: ${of.words(px, py)}`;
      sheet.append(() => dot.attr("cx", px).attr("cy", py).node());
      const at = new DOMPoint(px, py).matrixTransform(sheet.node().getScreenCTM());
      const room = frame.clientWidth - reading.offsetWidth;
      reading.style.left = `${Math.max(0, Math.min(at.x - left + 10, room)) + frame.scrollLeft}px`;
      reading.style.top = `${Math.max(0, at.y - top - reading.offsetHeight - 10)}px`;
    };
    const leave = () => { reading.textContent = ""; dot.remove(); };
    const hover = () => {
      const place = d3.mouse(sheet.node());
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
      const curve = curves[which], shown = curve.points.map(([px, py]) => [curve.of.view.applyX(px), py]).filter(curve.of.inside);
      if (!shown.length) { leave(); return; }
      const one = 1 / Math.max(Math.min(50, shown.length - 1), 1);
      where = where < 0 ? 0 : Math.min(Math.max(where + across * one, 0), 1);
      read(curve, ...shown[Math.round(where * (shown.length - 1))]);
    };

    // A figure whose panels all lie on one axis of time zooms along it, every other one is magnified.
    const [x, y, width, height] = svg.attr("viewBox").split(" ").map(Number);
    const area = time ? first.area : [[x, y], [x + width, y + height]];
    const zoomed = () => d3.zoomTransform(svg.node()).k > 1;
    const zoom = d3.zoom().extent(area).translateExtent(area).scaleExtent([1, MOST]).duration(0)
      .wheelDelta(() => -d3.event.deltaY * (d3.event.deltaMode ? 0.1 : 0.005))
      .filter(() => ({ wheel: d3.event.ctrlKey || d3.event.metaKey, mousedown: zoomed() && !d3.event.button })[d3.event.type] ?? true)
      .on("zoom", () => {
        const view = d3.event.transform;
        if (view.k === 1 && d3.event.sourceEvent && !frame.classList.contains("zoomed")) return;
        leave();
        frame.classList.toggle("zoomed", view.k > 1);
        if (!time) { sheet.attr("transform", view); return; }
        const span = view.k > 1 ? view.rescaleX(first.x.scale).domain() : [-Infinity, Infinity];
        panels.forEach((one) => one.show(span));
        if (leading) return;
        leading = true;
        figures.filter((one) => one.time === time && one.frame !== frame).forEach((one) => one.follow(span));
        leading = false;
      });
    svg.call(zoom).style("touch-action", null);
    figures.push({ frame, time, follow: (span) => zoom.transform(svg, fit(first.x.scale, span)) });
    frame.addEventListener("touchmove", (event) => {
      if (!zoomed() && event.touches.length < 2) event.preventDefault = () => {};  // one finger scrolls the page
    }, { capture: true, passive: true });

    const nearer = (times) => { if (times) zoom.scaleBy(svg, times); else zoom.transform(svg, whole); };
    const go = (across, down) => {
      const part = 0.2 / d3.zoomTransform(svg.node()).k, [[left, top], [right, bottom]] = area;
      zoom.translateBy(svg, -across * part * (right - left), -down * part * (bottom - top));
    };
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const keys = { "+": 1.5, "=": 1.5, "-": 1 / 1.5, "0": 0 };
    frame.addEventListener("keydown", (event) => {
      const arrow = arrows[event.key];
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (arrow && !event.shiftKey && !zoomed()) return;
      if (event.key in keys) nearer(keys[event.key]);
      else if (event.key === "Escape") leave();
      else if (!arrow) return;
      else if (event.shiftKey) walk(...arrow);
      else go(...arrow);
      event.preventDefault();
    });
    frame.addEventListener("blur", leave);
    d3.select(frame.parentNode).insert("p", ".wide").attr("class", "zoom").selectAll("button")
      .data([["+", 1.5, "Zoom in"], ["−", 1 / 1.5, "Zoom out"], ["all", 0, "Show all"]]).enter().append("button")
      .attr("type", "button").attr("title", ([, , label]) => label).attr("aria-label", ([, , label]) => label)
      .text(([text]) => text).on("click", ([, times]) => nearer(times));

    svg.on("pointerdown", hover)  // a finger does not hover
      .on("pointermove", () => { if (!zoomed() || !d3.event.buttons) hover(); })
      .on("pointerleave", () => { if (d3.event.pointerType !== "touch") leave(); });
    addEventListener("beforeprint", () => { leave(); nearer(0); });
  });
})();
