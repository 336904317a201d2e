for (const figure of document.querySelectorAll(".compare")) {
  const layers = figure.querySelectorAll("img");
  const slider = figure.querySelector("input[type=range]");
  const stack = figure.querySelector(".stack");
  const split = (percent) => {
    slider.value = percent;
    stack.style.setProperty("--split", percent + "%");
  };
  slider.addEventListener("input", () => split(slider.value));
  for (const radio of figure.querySelectorAll("input[type=radio]")) {
    radio.addEventListener("change", () =>
      layers.forEach((image, i) => image.classList.toggle("shown", i == radio.value)));
  }
  // Dragging on the picture moves the slider, too.
  stack.addEventListener("pointermove", (event) => {
    if (event.buttons !== 1) return;
    const box = stack.getBoundingClientRect();
    split(Math.round(100 * Math.min(1, Math.max(0, (event.clientX - box.left) / box.width))));
  });
  stack.addEventListener("dragstart", (event) => event.preventDefault());
}
