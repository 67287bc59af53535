import { defineConfig } from "vite";

// The server adds the content-security policy; nothing here may need inline script or style.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../src/tomoskin/server/static",
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rolldownOptions: { input: ["index.html", "robot.html"] },
  },
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
});
