/* What anybody would call wrong with how a page looks: facts that hold in any browser, on any
   machine. Installed before the page's own scripts; `looks.faults()` says what is wrong now. */

window.looks = (() => {
  const CONTROLS = "button, a[href], input, select, summary";
  const HIDDEN = "[inert], .unseen, title, option, noscript";
  /** Each is read row by row, from the left. */
  const READ = ".top, .legend, .tabs, .panel, .drawn, .timeline, .controls";
  const LANDMARKS = "header.top, .sheet, .side, .timeline, footer.controls";
  const SMALLEST = 12;
  const [TARGET, FINGER] = [24, 44];

  // What canvases write, since each was cleared.

  const written = new Map();
  const pen = CanvasRenderingContext2D.prototype;
  const { clearRect, fillText } = pen;

  pen.clearRect = function (...box) {
    written.set(this.canvas, []);
    return clearRect.apply(this, box);
  };

  pen.fillText = function (text, x, y) {
    const m = this.getTransform();
    const size = this.measureText(text);
    const corners = [-size.actualBoundingBoxLeft, size.actualBoundingBoxRight].flatMap((dx) =>
      [-size.actualBoundingBoxAscent, size.actualBoundingBoxDescent].map((dy) =>
        m.transformPoint({ x: x + dx, y: y + dy }),
      ),
    );
    const [xs, ys] = [corners.map((c) => c.x), corners.map((c) => c.y)];
    written.set(this.canvas, [
      ...(written.get(this.canvas) ?? []),
      {
        words: String(text),
        font: this.font,
        colour: this.fillStyle,
        pixels: Math.hypot(m.b, m.d) * parseFloat(this.font.match(/([\d.]+)px/)[1]),
        ready: document.fonts.check(this.font, text),
        box: box(Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)),
      },
    ]);
    return fillText.call(this, text, x, y);
  };

  // What is shown, each with its box in pixels of the page.

  function box(left, top, right, bottom) {
    return { left, top, right, bottom, width: right - left, height: bottom - top };
  }

  const visible = (element) =>
    element.checkVisibility({ visibilityProperty: true }) && !element.closest(HIDDEN);
  const ancestors = (element) => {
    const found = [];
    for (let each = element; each; each = each.parentElement) found.push(each);
    return found;
  };

  /** The part of a line of text that has ink, as good as always. */
  function inked({ left, top, right, bottom }, pixels) {
    const middle = (top + bottom) / 2;
    return box(left, middle - 0.36 * pixels, right, middle + 0.36 * pixels);
  }

  function domTexts() {
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const found = [];
    while (walker.nextNode()) {
      const node = walker.currentNode;
      const element = node.parentElement;
      if (!node.data.trim() || !visible(element)) continue;
      const style = getComputedStyle(element);
      const range = document.createRange();
      range.selectNodeContents(node);
      const svg = element instanceof SVGElement;
      const lines = svg ? [element.getBoundingClientRect()] : [...range.getClientRects()];
      const pixels = parseFloat(style.fontSize);
      for (const line of lines.filter(({ width }) => width > 0)) {
        found.push({ words: node.data.trim(), node, element, pixels, svg, style, box: inked(line, pixels) });
      }
    }
    return found;
  }

  function canvasTexts() {
    return [...written].flatMap(([canvas, texts]) => {
      if (!canvas.isConnected || !visible(canvas)) return [];
      const at = canvas.getBoundingClientRect();
      const scale = at.width / canvas.width;
      return texts.filter(({ words }) => words.trim()).map((text) => {
        const { left, top, right, bottom } = text.box;
        const place = [left, top, right, bottom].map((v) => v * scale);
        return {
          ...text,
          element: canvas,
          pixels: text.pixels * scale,
          inCanvas: text.box,
          box: box(at.left + place[0], at.top + place[1], at.left + place[2], at.top + place[3]),
        };
      });
    });
  }

  const controls = () =>
    [...document.querySelectorAll(CONTROLS)].filter(visible).map((element) => ({
      words: `${element.tagName.toLowerCase()} ${element.textContent.trim() || element.getAttribute("aria-label") || element.id}`,
      element,
      control: true,
      box: element.getBoundingClientRect(),
    }));

  // What cuts a box off: the page's edge, and every element around that hides what leaves it.

  function inside(element) {
    const { left, top } = element.getBoundingClientRect();
    const [x, y] = [left + element.clientLeft, top + element.clientTop];
    return box(x, y, x + element.clientWidth, y + element.clientHeight);
  }

  const scrolls = (style) => ["auto", "scroll"].includes(style.overflowY);

  /** Where a thing may be seen; `through`: up and down it may also be scrolled to. */
  function limits({ element, node }, through) {
    const room = box(0, 0, innerWidth, innerHeight);
    let free = false;
    const around = ancestors(node ? element : element.parentElement);
    for (const each of around.filter((one) => one instanceof HTMLElement && one !== document.body)) {
      const style = getComputedStyle(each);
      if (style.overflowX === "visible" || style.display === "inline" || each === document.documentElement) continue;
      const edge = inside(each);
      [room.left, room.right] = [Math.max(room.left, edge.left), Math.min(room.right, edge.right)];
      free ||= through && scrolls(style);
      if (!free) [room.top, room.bottom] = [Math.max(room.top, edge.top), Math.min(room.bottom, edge.bottom)];
    }
    if (free) [room.top, room.bottom] = [-Infinity, Infinity];
    return room;
  }

  const within = (a, b, slack = 1) =>
    a.left >= b.left - slack && a.right <= b.right + slack && a.top >= b.top - slack && a.bottom <= b.bottom + slack;
  const common = (a, b) =>
    Math.min(Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top));
  /** The part of it that is seen without scrolling. */
  function inView(thing) {
    const room = limits(thing, false);
    const { left, top, right, bottom } = thing.box;
    return box(Math.max(left, room.left), Math.max(top, room.top), Math.min(right, room.right), Math.min(bottom, room.bottom));
  }
  const shownPart = (element) => inView({ element, box: element.getBoundingClientRect() });
  const isSeen = (thing) => common(thing.box, inView(thing)) > 1;
  const place = ({ left, top, right, bottom }) => `[${[left, top, right, bottom].map(Math.round)}]`;
  const said = (thing) => `“${thing.words.slice(0, 40)}” at ${place(thing.box)}`;

  // A line that ends in an ellipsis says the whole where it is pointed at.
  const whole = ({ element, words }) =>
    ancestors(element).some((each) => getComputedStyle(each).textOverflow === "ellipsis") &&
    ancestors(element).some((each) => each.title.includes(words));

  /** A field's own words against its room. */
  function crowded(element) {
    if (element.matches("select")) {
      const { font, paddingLeft, paddingRight } = getComputedStyle(element);
      const ruler = document.createElement("canvas").getContext("2d");
      ruler.font = font;
      const arrow = 16;
      const room = element.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight) - arrow;
      return ruler.measureText(element.selectedOptions[0]?.text ?? "").width > room + 1;
    }
    return element.matches("input[type=text], input[type=number]") && element.scrollWidth > element.clientWidth + 1;
  }

  const cutOff = ({ texts, controls }) => [
    ...[...texts, ...controls].filter((thing) => !within(thing.box, limits(thing, true)) && !(thing.node && whole(thing)))
      .map((thing) => `${said(thing)} leaves ${place(limits(thing, true))}`),
    ...controls.filter(({ element }) => crowded(element)).map((thing) => `the value of ${said(thing)}`),
  ];

  const related = (a, b) => a.element.contains(b.element) || b.element.contains(a.element);

  const overlapping = ({ texts, controls }) => {
    const things = [...texts, ...controls].filter(isSeen).map((thing) => ({ ...thing, box: inView(thing) }));
    const found = [];
    things.forEach((a, k) => {
      for (const b of things.slice(k + 1)) {
        if ((a.control || b.control) && related(a, b)) continue;
        if (a.node && a.node === b.node) continue;
        if (common(a.box, b.box) > 1) found.push(`${said(a)} and ${said(b)}`);
      }
    });
    const grounds = [...document.querySelectorAll(`${LANDMARKS}, .drawer`)];
    grounds.forEach((a, k) => {
      for (const b of grounds.slice(k + 1)) {
        if (a.contains(b)) continue;
        if (common(shownPart(a), shownPart(b)) > 1) found.push(`${a.className} and ${b.className}`);
      }
    });
    return found;
  };

  /** What is drawn outside the part of the page that it belongs to. */
  const spilling = () =>
    [...document.querySelectorAll(LANDMARKS)].flatMap((part) => {
      const edge = part.getBoundingClientRect();
      return [...part.querySelectorAll("*")].filter(visible).flatMap((each) => {
        const shown = shownPart(each);
        if (shown.width <= 0 || shown.height <= 0 || within(shown, edge, 2)) return [];
        return [`${each.tagName} .${each.getAttribute("class")} at ${place(shown)} leaves ${place(edge)}`];
      });
    });

  /** Whether somebody who reads on from `a` finds `b`: not above it, not left of it on its line. */
  function follows(a, b) {
    const level = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    if (level > 0.5 * Math.min(a.bottom - a.top, b.bottom - b.top)) return b.left >= a.left - 1;
    return b.top > a.top || b.left >= a.right - 1;
  }

  const scroller = (element) => ancestors(element).find((each) => scrolls(getComputedStyle(each)));

  const outOfOrder = ({ texts }) => {
    const found = [];
    for (const part of document.querySelectorAll(READ)) {
      const read = texts.filter(({ element, node, svg }) => node && !svg && part.contains(element));
      read.slice(1).forEach((b, k) => {
        const a = read[k];
        if (a.node === b.node || scroller(a.element) !== scroller(b.element)) return;
        if (!follows(a.box, b.box)) found.push(`${said(b)} after ${said(a)}`);
      });
    }
    const marks = [...document.querySelectorAll(LANDMARKS)].map((each) => [each.className, each.getBoundingClientRect()]);
    marks.slice(1).forEach(([name, b], k) => {
      if (!follows(marks[k][1], b)) found.push(`${name} after ${marks[k][0]}`);
    });
    return found;
  };

  /** Rows of a table of electrodes are as high as its script counts on. */
  const least = (element) => (matchMedia("(pointer: coarse)").matches && !element.closest(".rows") ? FINGER : TARGET);
  const tooSmallToHit = ({ controls }) =>
    controls.filter(({ element, box: { width, height } }) => Math.min(width, height) < least(element) - 0.5)
      .map((thing) => `${said(thing)} of ${least(thing.element)} px`);

  const tooSmallToRead = ({ texts }) =>
    texts.filter(({ pixels }) => pixels < SMALLEST).map((thing) => `${said(thing)}: ${thing.pixels} px`);

  // Contrast, as WCAG 2.2 defines it (success criterion 1.4.3).

  const palette = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });

  function rgba(colour) {
    palette.clearRect(0, 0, 1, 1);
    palette.fillStyle = colour;
    palette.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = palette.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  }

  const over = (upper, lower, part) => lower.map((v, k) => (k < 3 ? part * upper[k] + (1 - part) * v : 1));

  function luminance([r, g, b]) {
    const [lr, lg, lb] = [r, g, b].map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * lr + 0.7152 * lg + 0.0722 * lb;
  }

  function ratio(a, b) {
    const [dark, light] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (light + 0.05) / (dark + 0.05);
  }

  const faint = (element) =>
    ancestors(element).reduce((part, each) => part * getComputedStyle(each).opacity, 1);

  /** The ground that an element and a colour on it have together, the farthest ancestor first. */
  function seen(element, colour) {
    let ground = rgba("Canvas");
    for (const each of ancestors(element).reverse()) {
      const { backgroundColor } = getComputedStyle(each);
      const own = rgba(backgroundColor);
      if (own[3] > 0) ground = over(own, ground, own[3]);
    }
    const ink = rgba(colour);
    return [over(ink, ground, ink[3] * faint(element)), ground];
  }

  /** What most of the canvas around a word is filled with; where with nothing, the page's ground. */
  function behind({ element, inCanvas: { left, top, width, height } }) {
    const context = element.getContext("2d");
    const pixels = context.getImageData(left, top, Math.max(1, width), Math.max(1, height)).data;
    const counted = new Map();
    for (let k = 0; k < pixels.length; k += 4) {
      const key = pixels[k + 3] < 128 ? "none" : pixels.slice(k, k + 3).join();
      counted.set(key, (counted.get(key) ?? 0) + 1);
    }
    const [most] = [...counted].reduce((a, b) => (b[1] > a[1] ? b : a));
    const [, ground] = seen(element, "#000");
    return most === "none" ? ground : over(most.split(",").map(Number), ground, faint(element));
  }

  function contrast(text) {
    const { element, style, svg, colour } = text;
    if (colour) return ratio(seen(element, colour)[0], behind(text));
    const ink = svg ? style.fill : style.color;
    if (svg && style.stroke !== "none" && parseFloat(style.strokeWidth) >= 3) return ratio(rgba(ink), rgba(style.stroke));
    return ratio(...seen(element, ink));
  }

  function needed({ pixels, style, font }) {
    const bold = style ? style.fontWeight >= 700 : /^(700|800|900|bold)/.test(font);
    return pixels >= 24 || (bold && pixels >= 18.66) ? 3 : 4.5;
  }

  const placeholders = (controls) =>
    controls.filter(({ element }) => element.placeholder && !element.value).map((thing) => {
      const style = getComputedStyle(thing.element, "::placeholder");
      return { ...thing, style, pixels: parseFloat(style.fontSize) };
    });

  const tooFaint = ({ texts, controls }) =>
    [...texts, ...placeholders(controls)]
      .filter((text) => isSeen(text) && !text.element.closest(":disabled") && contrast(text) < needed(text))
      .map((text) => `${said(text)}: ${contrast(text).toFixed(2)}, needs ${needed(text)}`);

  // A telephone's panels scroll inside the page, as drawers do.
  const scrolling = () => {
    const { scrollWidth, scrollHeight } = document.scrollingElement;
    const page = document.getElementById("page").getBoundingClientRect();
    const found = [];
    if (scrollWidth > innerWidth || page.right > innerWidth + 1) found.push(`${scrollWidth} px wide in ${innerWidth}`);
    if (scrollHeight > innerHeight || page.bottom > innerHeight + 1) found.push(`${scrollHeight} px high in ${innerHeight}`);
    if (innerWidth <= 600) return found;
    for (const each of document.querySelectorAll(".panels:not([inert]), .panels:not([inert]) .panel, .panels:not([inert]) .list")) {
      if (each.scrollHeight > each.clientHeight + 1) found.push(`${each.className}: ${each.scrollHeight} px in ${each.clientHeight}`);
    }
    return found;
  };

  /** Plots and the sheet have not taken their size yet. */
  const unfinished = () =>
    [...document.querySelectorAll(".plot")].filter(visible).filter((plot) => {
      const canvas = plot.querySelector("canvas");
      return canvas && Math.abs(canvas.getBoundingClientRect().height - plot.clientHeight) > 1;
    }).map((plot) => plot.getAttribute("aria-label"));

  const FACTS = { unfinished, cutOff, overlapping, spilling, outOfOrder, tooSmallToHit, tooSmallToRead, tooFaint, scrolling };

  return {
    /** Fact → what breaks it, in words; nothing where all is well. */
    faults() {
      const shown = { texts: [...domTexts(), ...canvasTexts()], controls: controls() };
      const found = Object.entries(FACTS).map(([name, fact]) => [name, fact(shown)]);
      return Object.fromEntries(found.filter(([, wrong]) => wrong.length));
    },
    /** The least size of the letters in what a selector names, px. */
    least(selector) {
      return Math.min(...domTexts().filter(({ element }) => element.matches(selector)).map(({ pixels }) => pixels));
    },
    /** What becomes wrong while a part of the page has another style. */
    faultsWith(selector, css) {
      const element = document.querySelector(selector);
      const before = element.getAttribute("style") ?? "";
      element.style.cssText += css;
      const found = this.faults();
      element.style.cssText = before;
      return found;
    },
    /** And while words are written on the sheet's canvas, to the right of `x` 0 twice. */
    faultsWithWords(x, font, colour) {
      const pen = [...document.querySelectorAll(".sheet canvas")].at(-1).getContext("2d");
      pen.save();
      Object.assign(pen, { font, fillStyle: colour, textAlign: "left" });
      pen.fillText("words", x, 60);
      if (x > 0) pen.fillText("words", x + 10, 62);
      pen.restore();
      return this.faults();
    },
    /** What canvases show. */
    canvasTexts: () => canvasTexts().map(({ words, font, ready }) => ({ words, font, ready })),
  };
})();
