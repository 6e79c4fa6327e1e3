// Figures as SVG, with axes, marks and keys. Text enters the page only as textContent.
'use strict';

/// Returns an element with attributes, text and children; the `name` of elements of SVG begins with "svg:".
function element(name, attributes = {}, ...children) {
  const made = name.startsWith('svg:')
    ? document.createElementNS('http://www.w3.org/2000/svg', name.slice(4))
    : document.createElement(name);
  for (const [key, value] of Object.entries(attributes))
    if (value !== null && value !== undefined && value !== false)
      made.setAttribute(key, value === true ? '' : value);
  for (const child of children) if (child !== null && child !== undefined) made.append(child);
  return made;
}

/// 1234567 → "1,234,567"; numbers that are not whole get three significant digits, as in the tables.
function readable(value) {
  if (Math.abs(value) < 999.5 && value !== Math.round(value)) {
    const size = Math.abs(value);
    if (size < 1e-4) return value.toExponential(2).replace(/\.?0+e/, 'e');
    return String(Number(value.toPrecision(3)));
  }
  return Math.round(value).toLocaleString('en-US');
}

const kColours = 8;
const kShapes = [
  'M0-5A5 5 0 1 1 0 5A5 5 0 1 1 0-5Z',
  'M-4.6-4.6H4.6V4.6H-4.6Z',
  'M0-5.8L5.4 4.2H-5.4Z',
  'M0 5.8L5.4-4.2H-5.4Z',
  'M0-6.2L5 0L0 6.2L-5 0Z',
  'M0-5.8L5.5-1.8L3.4 4.7H-3.4L-5.5-1.8Z',
  'M-1.8-5.6H1.8V-1.8H5.6V1.8H1.8V5.6H-1.8V1.8H-5.6V-1.8H-1.8Z',
  'M0-6.3L1.7-2H6L2.6.8L3.9 5.2L0 2.6L-3.9 5.2L-2.6.8L-6-2H-1.7Z',
];
const kDashes = [null, '7 4', '2 3', '9 3 2 3'];

/// Returns the colour, mark and dashes of the label with this number. Colours and shapes repeat together, and
/// the shapes shift by three in each round, so that 64 labels differ; every other round has hollow marks.
function styleOf(number) {
  const round = Math.floor(number / kColours);
  return {
    colour: `var(--c${number % kColours})`,
    shape: kShapes[(number + 3 * round) % kShapes.length],
    dash: kDashes[round % kDashes.length],
    hollow: round % 2 === 1,
  };
}

function mark(style, x, y, scale = 1) {
  return element('svg:path', {
    d: style.shape,
    transform: `translate(${x} ${y}) scale(${scale})`,
    fill: style.hollow ? 'var(--ground)' : style.colour,
    stroke: style.hollow ? style.colour : 'var(--ground)',
    'stroke-width': style.hollow ? 2 : 1,
  });
}

/// Returns an axis of all values: at() gives the position of a value, from 0 to 1, and ticks have texts.
function axisOf(values, log, zero) {
  let low = Math.min(...values),
    high = Math.max(...values);
  if (zero) low = Math.min(0, low);
  const to = log ? Math.log10 : (v) => v;
  let a = to(low),
    b = to(high);
  if (a === b) {
    a -= log ? 0.3 : Math.abs(a) * 0.1 || 1;
    b += log ? 0.3 : Math.abs(b) * 0.1 || 1;
    if (zero && !log) a = 0;
  }
  // Numbers that hardly differ would have ticks with the same text.
  if (log && b - a < 0.1) {
    const middle = (a + b) / 2;
    a = middle - 0.15;
    b = middle + 0.15;
  }
  const room = 0.05 * (b - a);
  a = zero && low === 0 ? 0 : a - room;
  b += room;
  const ticks = [];
  if (log) {
    // The densest set of digits that is not crowded; linear ticks if there are fewer than two of them.
    for (const digits of [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 3, 5, 7], [1, 2, 5], [1, 3], [1]]) {
      ticks.length = 0;
      for (let decade = Math.floor(a); decade <= Math.ceil(b); ++decade)
        for (const digit of digits) {
          const value = digit * 10 ** decade,
            at = Math.log10(value);
          if (at >= a && at <= b) ticks.push(value);
        }
      if (ticks.length <= 7) break;
    }
    if (ticks.length < 2) {
      ticks.length = 0;
      ticks.push(...linearTicks(10 ** a, 10 ** b));
    }
    if (ticks.length > 7) {
      const every = Math.ceil(ticks.length / 7);
      ticks.splice(0, ticks.length, ...ticks.filter((_, i) => i % every === 0));
    }
  } else {
    ticks.push(...linearTicks(a, b, values.every(Number.isInteger)));
  }
  return {
    at: (value) => (to(value) - a) / (b - a),
    ticks: ticks.map((value) => ({value, text: tickText(value, Math.max(...ticks))})),
  };
}

function linearTicks(a, b, whole = false) {
  const raw = (b - a) / 5,
    power = 10 ** Math.floor(Math.log10(raw));
  const found =
    [1, 2, 2.5, 5, 10].map((s) => s * power).find((s) => s >= raw && (!whole || s % 1 === 0 || s < 1)) ||
    10 * power;
  const step = whole ? Math.max(1, found) : found,
    ticks = [];
  for (let i = Math.ceil(a / step); i * step <= b + 1e-9 * step; ++i)
    ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

/// Returns the text of a tick; thousands become k if the greatest tick is at least 10,000.
function tickText(value, greatest) {
  const size = Math.abs(value);
  for (const [factor, unit] of [
    [1e9, 'G'],
    [1e6, 'M'],
    [1e3, 'k'],
  ])
    if (size >= factor && greatest >= 1e4)
      return String(Number((value / factor).toPrecision(3))) + '\u202f' + unit;
  if (size !== 0 && size < 1e-3) {
    const power = Math.floor(Math.log10(size) + 1e-9),
      digits = Number((value / 10 ** power).toPrecision(3));
    const superscript = (c) => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)];
    const raised = String(power).replace(/[-0-9]/g, superscript);
    return (digits === 1 ? '' : digits + '·') + '10' + raised;
  }
  return String(Number(value.toPrecision(6)));
}

/// Returns a mark that links to its row and shows `text` while it is hovered or has the focus.
function linkedMark(style, x, y, href, text, scale = 1) {
  const link = element(
    'svg:a',
    {href, tabindex: -1, 'aria-label': text},
    element('svg:circle', {cx: x, cy: y, r: 11, class: 'ring'}),
    mark(style, x, y, scale),
  );
  link.dataset.tip = text;
  return link;
}

/// Makes all links of a figure one tab stop; move(key, link, links) returns where an arrow key leads.
function roving(container, select, move) {
  const links = () => [...container.querySelectorAll(select)];
  const first = links()[0];
  if (first) first.setAttribute('tabindex', 0);
  container.addEventListener('focusin', (event) => {
    const link = event.target.closest(select);
    if (!link) return;
    for (const other of container.querySelectorAll(select + '[tabindex="0"]'))
      other.setAttribute('tabindex', -1);
    link.setAttribute('tabindex', 0);
  });
  container.addEventListener('keydown', (event) => {
    const link = event.target.closest && event.target.closest(select);
    if (!link || event.ctrlKey || event.altKey || event.metaKey) return;
    const to = move(event.key, link, links());
    if (!to) return;
    event.preventDefault();
    to.focus();
  });
}

function stepThrough(key, link, links) {
  const at = links.indexOf(link);
  if (key === 'ArrowRight' || key === 'ArrowDown') return links[Math.min(at + 1, links.length - 1)];
  if (key === 'ArrowLeft' || key === 'ArrowUp') return links[Math.max(at - 1, 0)];
  if (key === 'Home') return links[0];
  if (key === 'End') return links[links.length - 1];
  return null;
}

function keyOf(series, lines) {
  const list = element('ul', {class: 'key', 'aria-label': 'Key'});
  for (const one of series) {
    const style = styleOf(one.style);
    const glyph = element('svg:svg', {viewBox: '0 0 26 16', 'aria-hidden': 'true'});
    if (lines)
      glyph.append(
        element('svg:path', {
          d: 'M0 8H26',
          class: 'curve',
          stroke: style.colour,
          'stroke-dasharray': style.dash,
        }),
      );
    glyph.append(mark(style, 13, 8));
    list.append(element('li', {}, glyph, one.label));
  }
  return list;
}

/// Width of a figure's view box; narrow windows get a narrow box, so that the text is not too small.
const kPlotWidth = innerWidth < 700 ? 420 : 640;

/// Returns a figure of points {x, y, low, high, href, text}, joined or not.
function curvesFigure(figure) {
  const points = figure.series.flatMap((one) => one.points);
  const xAxis = axisOf(
    points.map((p) => p.x),
    figure.log_x,
    false,
  );
  if (figure.x_texts) {
    // Names instead of numbers, as many as fit.
    const every = Math.ceil(figure.x_texts.length / 8);
    xAxis.ticks = figure.x_texts
      .map((text, value) => ({value, text}))
      .filter(({value}) => value % every === 0 && points.some((p) => p.x >= value));
    xAxis.ticks = xAxis.ticks.filter(({value}) => xAxis.at(value) >= 0 && xAxis.at(value) <= 1);
  }
  const yAxis = axisOf(
    points.flatMap((p) => [p.y, ...(p.low === null ? [] : [p.low, p.high])]),
    figure.log_y,
    figure.zero_y,
  );
  const height = 400,
    left = 64,
    right = 16,
    top = 12,
    bottom = 52;
  const X = (v) => left + xAxis.at(v) * (kPlotWidth - left - right),
    Y = (v) => height - bottom - yAxis.at(v) * (height - top - bottom);
  const svg = element('svg:svg', {
    viewBox: `0 0 ${kPlotWidth} ${height}`,
    role: 'group',
    'aria-label': `${figure.title}: ${figure.y_label} over ${figure.x_label}`,
  });
  const back = element('svg:g', {'aria-hidden': 'true'});
  for (const tick of xAxis.ticks) {
    const x = X(tick.value);
    back.append(
      element('svg:path', {class: 'grid', d: `M${x} ${top}V${height - bottom}`}),
      element('svg:text', {x, y: height - bottom + 18, 'text-anchor': 'middle'}, tick.text),
    );
  }
  for (const tick of yAxis.ticks) {
    const y = Y(tick.value);
    back.append(
      element('svg:path', {class: 'grid', d: `M${left} ${y}H${kPlotWidth - right}`}),
      element('svg:text', {x: left - 6, y: y + 4, 'text-anchor': 'end'}, tick.text),
    );
  }
  back.append(
    element('svg:path', {class: 'axis', d: `M${left} ${top}V${height - bottom}H${kPlotWidth - right}`}),
    element(
      'svg:text',
      {x: (left + kPlotWidth - right) / 2, y: height - 10, 'text-anchor': 'middle'},
      figure.x_label + (figure.log_x ? ' (logarithmic)' : ''),
    ),
    element(
      'svg:text',
      {transform: `translate(14 ${(top + height - bottom) / 2}) rotate(-90)`, 'text-anchor': 'middle'},
      figure.y_label + (figure.log_y ? ' (logarithmic)' : ''),
    ),
  );
  svg.append(back);
  if (figure.front) {
    // The points that are lower than all points to their left.
    let path = '',
      best = Infinity;
    for (const p of [...points].sort((a, b) => a.x - b.x || a.y - b.y))
      if (p.y < best) {
        path += path ? `H${X(p.x)}V${Y(p.y)}` : `M${X(p.x)} ${Y(p.y)}`;
        best = p.y;
      }
    svg.append(element('svg:path', {class: 'front', d: path, 'aria-hidden': 'true'}));
  }
  for (const one of figure.series) {
    const style = styleOf(one.style);
    if (figure.lines && one.points.length > 1)
      svg.append(
        element('svg:path', {
          class: 'curve',
          stroke: style.colour,
          'stroke-dasharray': style.dash,
          'aria-hidden': 'true',
          d: one.points.map((p, i) => `${i ? 'L' : 'M'}${X(p.x)} ${Y(p.y)}`).join(''),
        }),
      );
    for (const p of one.points)
      if (p.low !== null)
        svg.append(
          element('svg:path', {
            class: 'whisker',
            stroke: style.colour,
            'aria-hidden': 'true',
            d: `M${X(p.x) - 5} ${Y(p.low)}h10m-5 0V${Y(p.high)}m-5 0h10`,
          }),
        );
  }
  // Points often coincide, so each mark is smaller than those below it.
  figure.series.forEach((one, i) => {
    const above = figure.series.length > 1 ? 1 - i / (figure.series.length - 1) : 0.5;
    for (const p of one.points)
      svg.append(linkedMark(styleOf(one.style), X(p.x), Y(p.y), p.href, p.text, 0.95 + 0.4 * above));
  });
  const box = element(
    'figure',
    {},
    element('figcaption', {}, figure.title),
    svg,
    keyOf(figure.series, figure.lines),
  );
  if (figure.note) box.append(element('p', {class: 'soft'}, figure.note));
  if (figure.front)
    box.append(
      element(
        'p',
        {class: 'soft'},
        'The dashed line joins the meshes that no other one beats in both numbers.',
      ),
    );
  roving(svg, 'a', stepThrough);
  return box;
}

/// Returns a figure with one line for each point {x, low, high, href, text} and the labels to the left.
function dotsFigure(figure) {
  const all = figure.series.flatMap((one) =>
    one.points.map((p) => ({...p, label: one.label, style: one.style})),
  );
  const axis = axisOf(
    all.flatMap((p) => [p.x, ...(p.low === null ? [] : [p.low, p.high])]),
    figure.log_x,
    false,
  );
  const longest = Math.max(...all.map((p) => p.label.length));
  const left = Math.min(0.47 * kPlotWidth, 20 + 6.6 * longest),
    right = 20,
    top = 8,
    line = 22,
    bottom = 48,
    height = top + bottom + line * all.length;
  const X = (v) => left + axis.at(v) * (kPlotWidth - left - right);
  const svg = element('svg:svg', {
    viewBox: `0 0 ${kPlotWidth} ${height}`,
    role: 'group',
    'aria-label': `${figure.title}: ${figure.x_label}`,
  });
  const back = element('svg:g', {'aria-hidden': 'true'});
  const ticks = axis.ticks.filter(
    (tick, i) => i === 0 || all.length === 0 || X(tick.value) - X(axis.ticks[i - 1].value) > 34,
  );
  for (const tick of ticks)
    back.append(
      element('svg:path', {class: 'grid', d: `M${X(tick.value)} ${top}V${height - bottom}`}),
      element('svg:text', {x: X(tick.value), y: height - bottom + 18, 'text-anchor': 'middle'}, tick.text),
    );
  back.append(
    element('svg:path', {class: 'axis', d: `M${left} ${height - bottom}H${kPlotWidth - right}`}),
    element(
      'svg:text',
      {x: (left + kPlotWidth - right) / 2, y: height - 8, 'text-anchor': 'middle'},
      figure.x_label + (figure.log_x ? ' (logarithmic)' : ''),
    ),
  );
  svg.append(back);
  const most = Math.floor((left - 14) / 6.6);
  all.forEach((p, i) => {
    const y = top + line * (i + 0.5),
      style = styleOf(p.style);
    const label = p.label.length > most ? p.label.slice(0, most - 1) + '…' : p.label;
    svg.append(
      element('svg:text', {x: left - 10, y: y + 4, 'text-anchor': 'end', 'aria-hidden': 'true'}, label),
      element('svg:path', {class: 'grid', d: `M${left} ${y}H${kPlotWidth - right}`, 'aria-hidden': 'true'}),
    );
    if (p.low !== null)
      svg.append(
        element('svg:path', {
          class: 'whisker',
          stroke: style.colour,
          'aria-hidden': 'true',
          d: `M${X(p.low)} ${y - 5}v10M${X(p.low)} ${y}H${X(p.high)}M${X(p.high)} ${y - 5}v10`,
        }),
      );
    svg.append(linkedMark(style, X(p.x), y, p.href, p.text));
  });
  roving(svg, 'a', stepThrough);
  return element(
    'figure',
    {},
    element('figcaption', {}, figure.title),
    svg,
    figure.note ? element('p', {class: 'soft'}, figure.note) : null,
  );
}

function figureElement(figure) {
  return figure.kind === 'dots' ? dotsFigure(figure) : curvesFigure(figure);
}

/// Shows the text of a mark next to it while it is hovered or has the focus.
function showTips(tip) {
  const show = (event) => {
    const link = event.target.closest && event.target.closest('[data-tip]');
    if (!link) return;
    tip.textContent = link.dataset.tip;
    tip.hidden = false;
    const box = link.getBoundingClientRect(),
      own = tip.getBoundingClientRect();
    tip.style.left = `${Math.max(4, Math.min(box.right + 6, innerWidth - own.width - 8))}px`;
    tip.style.top = `${Math.max(4, Math.min(box.top - own.height - 4, innerHeight - own.height - 8))}px`;
  };
  const hide = () => {
    tip.hidden = true;
  };
  document.addEventListener('pointerover', show);
  document.addEventListener('focusin', show);
  document.addEventListener('pointerout', hide);
  document.addEventListener('focusout', hide);
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') hide();
  });
}
