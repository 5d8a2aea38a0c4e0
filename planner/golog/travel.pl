:- module(planner_travel,
          [ travel/2,                   % +Tables, -Travel
            no_travel/1,                % -Travel
            travel_time/5,              % +Travel, +Robot, ?From, +To, -Milliseconds
            place_index/3               % +Travel, +Place, -Index
          ]).

/** <module> How long robots travel

    travel(Index, Profiles, Between, Here)
      Index     AVL tree: place -> 1..N
      Profiles  AVL tree: robot -> number of its table
      Between   t(Table, ...), Table = m(Row, ...), Row = r(Milliseconds, ...): from a place to each place
      Here      AVL tree: robot -> Row, from where it is when the plan is made

-1 stands for no way. Robots that travel alike share a table, so that large fleets stay small here.
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).

%!  travel(+Tables, -Travel) is det.
%
%   Tables is tables(Places, Robots, Matrices): Robots a list of robot(Name, Profile, Here), with Profile
%   counting from 1 and Here a list of milliseconds; Matrices a list of lists of rows.

travel(tables(Places, Robots, Matrices), travel(Index, Profiles, Between, Here)) :-
    length(Places, N),
    findall(I, between(1, N, I), Numbers),
    pairs_keys_values(Indexed, Places, Numbers),
    list_to_assoc(Indexed, Index),
    findall(Name-Profile, member(robot(Name, Profile, _), Robots), Profiled),
    list_to_assoc(Profiled, Profiles),
    maplist(matrix, Matrices, Tables),
    compound_name_arguments(Between, t, Tables),
    findall(Name-Row, ( member(robot(Name, _, Times), Robots), compound_name_arguments(Row, r, Times) ), Rows),
    list_to_assoc(Rows, Here).

matrix(Rows, Matrix) :-
    maplist([Times, Row]>>compound_name_arguments(Row, r, Times), Rows, Terms),
    compound_name_arguments(Matrix, m, Terms).

%!  no_travel(-Travel) is det.
%
%   No robot can travel anywhere.

no_travel(Travel) :-
    travel(tables([], [], []), Travel).

%!  travel_time(+Travel, +Robot, ?From, +To, -Milliseconds) is nondet.
%
%   From is `here` (where the robot is when the plan is made) or a place; fails where there is no way.

travel_time(travel(Index, Profiles, Between, Here), Robot, From, To, Milliseconds) :-
    get_assoc(To, Index, J),
    (   From == here
    ->  get_assoc(Robot, Here, Row)
    ;   nonvar(From)
    ->  get_assoc(From, Index, I),
        row(Robot, I, Profiles, Between, Row)
    ;   From = here,
        get_assoc(Robot, Here, Row)
    ;   gen_assoc(From, Index, I),
        row(Robot, I, Profiles, Between, Row)
    ),
    arg(J, Row, Milliseconds),
    Milliseconds >= 0.

row(Robot, I, Profiles, Between, Row) :-
    get_assoc(Robot, Profiles, P),
    arg(P, Between, Table),
    arg(I, Table, Row).

place_index(travel(Index, _, _, _), Place, I) :-
    get_assoc(Place, Index, I).
