/* The plan checked in the browser: the plan's words against figures of the rig, by sums that anybody can follow.
 *
 * Each check gives { what, holds, found }. Letters: k blendshapes, m markers, s sites, e expressions.
 */
"use strict";
CapturePlan.check = function (plan, rig) {
  const lines = [];
  const say = (what, holds, found) => lines.push({ what, holds: Boolean(holds), found });
  const landmarks = plan.layout.landmarks, markers = [...landmarks, ...plan.layout.head];
  const wants = plan.settings.landmarks, packing = plan.packing;
  const some = (list) => (list.length ? list.slice(0, 3).join("; ") + (list.length > 3 ? ` and ${list.length - 3} more` : "") : "");
  const same = (a, b) => JSON.stringify([...a].sort()) === JSON.stringify([...b].sort());

  // cover: r[m, k] >= epsilon
  const stands = (m) => rig.used.filter((_, k) => rig.moved[m.name]?.[k] >= wants.epsilon - 1e-6);
  const wrong = markers.filter((m) => !same(stands(m), m.blendshapes)).map((m) => m.name);
  const seen = new Set(landmarks.flatMap(stands));
  const unseen = rig.used.filter((name) => !seen.has(name));
  say("Each marker moves with what it stands for", !wrong.length, some(wrong) || `${markers.length} markers`);
  say("Every blendshape has a marker, but for those listed", same(unseen, plan.layout.uncovered), `${seen.size} of ${rig.used.length}`);

  // prices: sum_k y[k] c[k, s] <= n[s] at every site, so that any cover has sum_k y[k] landmarks or more
  const prices = rig.used.map(() => 0), said = plan.layout.certificate;
  said.blendshapes.forEach((name, i) => { prices[rig.used.indexOf(name)] = said.weights[i]; });
  const paid = prices.reduce((sum, y) => sum + y, 0);
  const over = rig.sites.filter(([n, ks]) => ks.reduce((sum, k) => sum + prices[k], 0) > n + 1e-9).length;
  const least = Math.ceil(paid - 1e-9);
  say(`No fewer than ${said.landmarks} landmarks show every blendshape`, !over && prices.every((y) => y >= 0) && least === said.landmarks,
    `prices add up to ${paid.toFixed(3)}; too high at ${over} of ${rig.sites.length} kinds of places`);
  say("The layout has as many as are needed", landmarks.length >= least || plan.layout.uncovered.length > 0, `${landmarks.length} landmarks`);

  // places, sides, distances
  const [middle, half] = rig.middle;
  const side = (x) => (Math.abs(x - middle) <= half ? "middle" : x > middle ? "left" : "right");
  const off = markers.filter((m) => !(Math.hypot(...m.position.map((x, i) => x - (rig.places[m.name] || [])[i])) < 2e-3)).map((m) => m.name);
  const turned = markers.filter((m) => side(m.position[0]) !== m.side || ["left", "right"].some((word) => m.label.split(" ")[0] === word && m.side !== word));
  say("Markers lie where the rig has their vertex", !off.length, some(off) || `${markers.length} markers`);
  say("Left markers lie on the actor’s left", !turned.length, some(turned.map((m) => `${m.name} ${m.label}`)) || "all");
  const gaps = markers.flatMap((a, i) => markers.slice(i + 1).map((b) => [Math.hypot(...a.position.map((x, n) => x - b.position[n])), `${a.name} and ${b.name}`])).sort((one, other) => one[0] - other[0]);
  const near = gaps.filter(([mm]) => mm < wants.spacing_mm - 0.01).map(([mm, both]) => `${both} ${mm.toFixed(2)} mm`);
  if (wants.spacing_mm && wants.method !== "trivial") {
    say(`Markers stand ${wants.spacing_mm} mm apart, straight and so along the skin`, !near.length, some(near) || `the nearest two are ${gaps.length ? gaps[0][0].toFixed(1) : "∞"} mm apart`);
  }

  // expressions: once each, disjoint, partners together
  const lists = [...packing.expressions.map((e) => e.blendshapes), ...packing.unscanned];
  const key = (a, b) => (a < b ? `${a}\n${b}` : `${b}\n${a}`);
  const shared = new Map(rig.shared.map(([a, b, n]) => [key(a, b), n]));
  const barred = new Set(rig.barred.map(([a, b]) => key(a, b)));
  const partners = CapturePlan.joined(rig.names, rig.partners);
  const clash = lists.flatMap((names, e) => names.flatMap((a, i) => names.slice(i + 1).flatMap((b) => {
    const n = partners.get(a)?.has(b) ? 0 : shared.get(key(a, b)) || 0;
    return n ? [`E${e + 1}: ${a} and ${b} share ${n} vertices`] : barred.has(key(a, b)) ? [`E${e + 1}: ${a} and ${b} exclude each other`] : [];
  })));
  say("Every blendshape is in one expression or listed as left out", same(lists.flat(), rig.names) && same(packing.left_out, packing.unscanned.flat()), `${lists.length} expressions`);
  say("No two of an expression share skin or exclude each other", !clash.length, some(clash) || "none");
  const place = new Map(lists.flatMap((names, e) => names.map((name) => [name, e])));
  const split = rig.together.filter((group) => new Set(group.map((name) => place.get(name))).size > 1);
  say("Partners are performed together", !split.length, some(split.map((group) => group.join(" and "))) || "all");

  // clique: of every two items some blendshapes cannot be together; or movements counted
  const item = CapturePlan.joined(rig.names, rig.together);
  const apart = (a, b) => shared.has(key(a, b)) || barred.has(key(a, b))
    || (a in rig.numbers && b in rig.numbers && rig.numbers[a] !== rig.numbers[b]);
  const fit = packing.clique.flatMap((a, i) => packing.clique.slice(i + 1).filter((b) => item.get(a) === item.get(b)
    || ![...(item.get(a) || [])].some((x) => [...(item.get(b) || [])].some((y) => apart(x, y)))).map((b) => `${a} and ${b} fit together`));
  const movements = (names) => new Set(CapturePlan.joined([...names], rig.pairs).values()).size;
  const things = [...new Set(item.values())].reduce((sum, names) => sum + movements(names), 0);
  const bound = Math.max(packing.clique.length, rig.most ? Math.ceil(things / rig.most) : 0);
  say(`No list has fewer than ${packing.bound} expressions`, !fit.length && packing.bound === bound && bound <= lists.length,
    some(fit) || `a clique of ${packing.clique.length}, ${things} movements`);
  say(`${packing.objective} expressions, ${packing.proven_optimal ? "" : "not "}proved the fewest`,
    packing.objective === lists.length && packing.proven_optimal === (bound === lists.length), `${lists.length} listed, ${bound} proved`);
  return lines;
};

/* Map from each name to the set of those it is linked to, directly or by others. */
CapturePlan.joined = function (names, links) {
  const group = new Map(names.map((name) => [name, new Set([name])]));
  for (const link of links) {
    const merged = new Set(link.filter((name) => group.has(name)).flatMap((name) => [...group.get(name)]));
    for (const name of merged) group.set(name, merged);
  }
  return group;
};

/* Writes the lines into a list, ticks and crosses before them, and says how many hold. */
CapturePlan.showChecks = function (list, total, plan, rig) {
  if (rig.missing) {
    total.textContent = `Not checked here: ${rig.missing}`;
    return;
  }
  let lines;
  try { lines = CapturePlan.check(plan, rig); } catch (error) { lines = [{ what: "The plan can be read", holds: false, found: String(error) }]; }
  for (const { what, holds, found } of lines) {
    const mark = CapturePlan.element("b", { role: "img", "aria-label": holds ? "holds" : "does not hold" }, holds ? "✓" : "✗");
    list.append(CapturePlan.element("li", { class: holds ? "holds" : "fails" }, mark,
      CapturePlan.element("span", {}, what, CapturePlan.element("small", {}, found))));
  }
  total.textContent = `${lines.filter((line) => line.holds).length} of ${lines.length} checks hold.`;
};
