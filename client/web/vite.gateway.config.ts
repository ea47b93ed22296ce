// The gateway as one file for Node, beside the page.
import { defineConfig } from 'vite';

export default defineConfig({
  ssr: { noExternal: true },
  build: {
    ssr: 'gateway/main.ts',
    target: 'node18',
    outDir: process.env.RILIEVO_WEB_OUT ?? 'generated/dist',
    emptyOutDir: false,
    copyPublicDir: false,
    rollupOptions: { output: { entryFileNames: 'gateway.mjs' } },
  },
});
