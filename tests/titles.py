"""Titles that would end a comment, go on in the next line, or mean something to a program that reads the file."""

HARD = (
    "ends */ here /* and begins",
    "**//*/ /*/",
    "goes on \\",
    "goes on & ",
    "trigraph ??/",
    "*" * 99 + "*/" + "/" * 30,
    '"""quotes""" #= -- !$omp <!-- ${x} {{ y }} %s $(rm) `ls`',
    'four """" and five """"" and one "',
    'three """ that nothing ends',
    "three --- and more ---> <!---- ]]> -",
    "coding: utf-16, coding=latin-1",
    "Kugeln \u00e4 \u4e16\u754c \U0001f600",
    "two\nlines\r\u2028\u0085 and \t\x1b[31m\0",
    "reads \u202ebackwards\u2066",
    "'it' # is \\n <b>&amp;</b> &",
)
