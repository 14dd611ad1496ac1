// The search of the reference: entries with every word in their title or text, first those with a title that begins so.
const box = document.getElementById("search");
const list = document.getElementById("found");
const MOST = 30;

function rank([title, , about], words) {
  const name = title.toLowerCase().replace(/^swarm[. ]/, "");
  const text = `${name} ${about.toLowerCase()}`;
  if (!words.every((word) => text.includes(word))) return -1;
  const first = words[0];
  if (name === first || name.startsWith(`${first} `)) return 4;
  return name.startsWith(first) ? 3 : name.includes(first) ? 2 : 1;
}

function show() {
  const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
  list.replaceChildren();
  if (!words.length) return;
  const found = ENTRIES.map((entry) => [rank(entry, words), entry]).filter(([score]) => score > 0);
  found.sort((one, other) => other[0] - one[0]);
  for (const [, [title, address, about]] of found.slice(0, MOST)) {
    const item = document.createElement("li");
    const link = document.createElement("a");
    link.href = address;
    link.textContent = title;
    item.append(link);
    if (about) {
      const small = document.createElement("small");
      small.textContent = about;
      item.append(small);
    }
    list.append(item);
  }
  if (!found.length) {
    const item = document.createElement("li");
    item.textContent = "nothing found";
    list.append(item);
  }
}

box.addEventListener("input", show);
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== box) {
    event.preventDefault();
    box.focus();
  }
});
