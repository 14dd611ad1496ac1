"use strict";
// A click on a column sorts the rows, a second one the other way; #sort=N or #sort=-N in the address does so at once.
function sortBy(table, column, down) {
  const body = table.tBodies[0], key = (row) => row.cells[column].dataset.value;
  const compared = (a, b) => {
    const x = key(a), y = key(b);
    if (x === "" || y === "") return (x === "") - (y === "");  // what is not known comes last
    const order = isNaN(x) || isNaN(y) ? x.localeCompare(y) : x - y;
    return down ? -order : order;
  };
  body.append(...Array.from(body.rows).sort(compared));
  Array.from(table.tHead.rows[0].cells).forEach((cell, k) => {
    if (k === column) cell.setAttribute("aria-sort", down ? "descending" : "ascending");
    else cell.removeAttribute("aria-sort");
  });
}
const table = document.querySelector("table.runs");
Array.from(table.tHead.rows[0].cells).forEach((cell, k) => cell.querySelector("button").addEventListener("click", () =>
  sortBy(table, k, cell.getAttribute("aria-sort") === "ascending")));
const asked = /^#sort=(-?)(\d+)$/.exec(location.hash);
if (asked && asked[2] < table.tHead.rows[0].cells.length) sortBy(table, Number(asked[2]), asked[1] === "-");
