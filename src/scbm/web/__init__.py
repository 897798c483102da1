"""`scbm console`: a page in which each click is a line of a test case, its server and its worker process.

It stands beside the core, which names its verb as text. Starlette and uvicorn (extra `web`) are imported here alone.
"""
