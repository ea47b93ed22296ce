// The tests, one module each, for Node.
import { defineConfig } from 'vite';

export default defineConfig({
  build: {
    ssr: true,
    target: 'node18',
    outDir: process.env.RILIEVO_WEB_TESTS ?? 'generated/tests',
    emptyOutDir: true,
    copyPublicDir: false,
    rollupOptions: {
      input: Object.fromEntries(['gateway', 'decoder', 'page', 'formats', 'exports', 'loader', 'first_layer'].map((part) => [`${part}.test`, `tests/${part}.test.ts`])),
    },
  },
});
