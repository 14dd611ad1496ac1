"""The figures of García Orden & Ortega 2007, and what lies beyond them: `python -m examples.paper`.

Each module draws one figure or one group of figures that share an axis, and gives the rows of its results in the table
"what the paper says against what we get". All of them have the same three functions:

numbers() -> Numbers       runs the engine
draw(numbers, folder)      writes the figure, returns its file
rows(numbers)              lines of the table

fig_*.py reproduce the paper; beyond_*.py go where its method stops. cases.py holds the paper's data.
"""
