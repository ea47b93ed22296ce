// The page. RILIEVO_WASM: the module that CMake built; RILIEVO_WEB_OUT: the folder to build into.
import { resolve } from 'node:path';
import { defineConfig } from 'vite';

export default defineConfig({
  base: './',
  resolve: {
    alias: [
      {
        find: /^rilievo\.wasm/,
        replacement: resolve(process.env.RILIEVO_WASM ?? '../../build/release/web/rilievo.wasm'),
      },
    ],
  },
  assetsInclude: ['**/*.wasm', '**/*.dss'],
  worker: { format: 'es' },
  build: {
    target: 'es2022',
    outDir: resolve(process.env.RILIEVO_WEB_OUT ?? 'generated/dist', 'page'),
    emptyOutDir: true,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
